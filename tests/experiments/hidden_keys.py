"""Keys of hidden effects and verdicts, as the scorer reads them."""


def hidden(**causes):
    """A key: name → (size, parameters); `family` for what is outside."""
    family = causes.pop("family", None)
    reported = [{"name": n, "size": s, "parameters": given(**p)} for n, (s, p) in causes.items()]
    verdict = "unknown" if family else "named" if reported else "none"
    structure = {"family": family} if family else None
    return {"contract": 1, "verdict": verdict, "causes": reported, "structure": structure}


def given(**parameters):
    """Values with units, and 90 % intervals where there are four of them."""
    names = ("value", "unit", "low", "high")
    return {k: dict(zip(names, v, strict=False)) for k, v in parameters.items()}


def named(*names, **more):
    causes = [{"name": name, "probability": 0.95, "parameters": {}} for name in names]
    return {"contract": 1, "verdict": "named", "causes": causes} | more


NONE = {"contract": 1, "verdict": "none", "causes": [], "ranking": [], "structure": None}
