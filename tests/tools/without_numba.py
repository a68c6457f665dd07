"""What an installed wheel must do where numba is not installed: python without_numba.py; `make wheel` runs it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def main() -> None:
    assert importlib.util.find_spec("numba") is None, "numba is installed here"

    import darboux as dx
    from darboux.kernels import jit

    assert not jit.AT_FIRST_CALL, "the kernels are not compiled in this installation"

    rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=dx.Material(E=1e6, nu=0.5, density=1e3))
    problem = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])
    began = time.process_time()
    tips = [
        dx.solve(problem, method).tip for method in (dx.Collocation(), dx.Shooting(), dx.Elastica(), dx.DiscreteRod(30))
    ]
    assert abs(tips[0] - tips[1]).max() < 1e-8 > abs(tips[0] - tips[2]).max(), tips
    assert abs(tips[0] - tips[3]).max() < 1e-3, tips
    stretching = dx.Equilibrium(
        dx.Rod(length=0.25, section=rod.section, material=rod.material, stretch=True),
        start=problem.start,
        loads=problem.loads,
    )
    for integrator in (dx.ImplicitMidpoint(4), dx.TRBDF2(4), dx.StormerVerlet(4)):
        dx.simulate(dx.Motion(stretching, 1e-3), integrator, records=1)
    assert dx.natural_modes(problem, 2).frequencies[0] > 0
    print(f"solved and moved in {time.process_time() - began:.2f} CPU s")

    with tempfile.TemporaryDirectory() as folder:
        command = Path(sys.executable).with_name("darboux")
        for words in (["new", "cantilever"], ["solve", "cantilever.toml", "-q"], ["doctor"]):
            done = subprocess.run([command, *words], cwd=folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, (words, done.stdout, done.stderr)
            assert not done.stderr, done.stderr
        assert "compiled when darboux was built" in " ".join(done.stdout.split()), done.stdout

    assert "numba" not in sys.modules
    print(f"darboux {dx.__version__} runs without numba")


main()
