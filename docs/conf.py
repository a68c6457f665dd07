"""The site: MyST pages that are executed, the reference from docstrings, the gallery from examples/."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from darboux import __version__

HERE = Path(__file__).parent
EXTENSIONS = str(HERE / "_extensions")
sys.path.insert(0, EXTENSIONS)

# What the pages' kernels and the examples find: `darboux` as a command, `%load_ext shell`, our look of figures.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [EXTENSIONS, os.environ.get("PYTHONPATH")]))
os.environ["MATPLOTLIBRC"] = str(HERE / "_static" / "matplotlibrc")
os.environ["COLUMNS"] = "96"
os.environ.pop("MPLBACKEND", None)  # a kernel takes its own, which puts figures into the page

project = "darboux"
author = "The darboux developers"
version = release = __version__
copyright = "the darboux developers, BSD-3-Clause"  # noqa: A001  # Sphinx asks for this name

extensions = ["myst_nb", "sphinx.ext.autodoc", "mathml", "docstrings", "gallery", "offline"]
exclude_patterns = ["_build", "_extensions", "_static"]

myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_ipywidgets_js = {}  # they would come from elsewhere

autodoc_typehints = "none"  # a docstring says shape and unit, which types do not
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
default_role = "code"
add_module_names = False

html_theme = "furo"
html_title = "darboux"
html_static_path = ["_static"]
html_css_files = ["darboux.css"]
html_math_renderer = "mathml"
html_show_sphinx = False
html_copy_source = False
pygments_style = "friendly"
pygments_dark_style = "monokai"
