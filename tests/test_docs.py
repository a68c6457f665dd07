

def test_a_method_stands_on_its_floor() -> None:
    """The contract that keeps methods apart knows them by their modules' names, and not those that nobody gave it."""
    contracts = tomllib.loads((DOCS.parent / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(x["layers"] for x in contracts if x["name"] == "Methods do not import one another")
    methods = {name for name in dx.__all__ if hasattr(getattr(dx, name), "refuses")}
    modules = {getattr(dx, name).__module__.rpartition(".")[2] for name in methods}
    missing = modules - set(re.findall(r"\w+", layers[1]))
    assert not missing, f"pyproject.toml: {sorted(missing)} belong into the contract, on the floor {layers[1]}"
