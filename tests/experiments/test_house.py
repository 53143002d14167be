"""Files, rooms, arrows, levels and formulas of a small tree, counted by hand."""

import pytest

from pipelines.experiments import house

TREE = {
    "shiplog/__init__.py": "",
    "shiplog/sea/__init__.py": "",
    "shiplog/sea/waves/__init__.py": '"""x = y is no function\'s."""\n',
    "shiplog/sea/waves/swell.py": (
        "def rise(t):\n    \"\"\"h = a sin ω t.\n\n    In metres.\"\"\"\n"
        "    def inner():\n        return t\n    return inner\n"
    ),
    "shiplog/sea/waves/gusts.py": "from shiplog.sea.waves import swell\n",
    "shiplog/sea/tide.py": (
        "from shiplog.sea.waves.swell import rise\nimport os\n"
        'def rise_of_tide():\n    """Two lines."""\n'
    ),
    "shiplog/sea/chart.py": (
        "def rise():\n    from shiplog.sea import tide, waves\n    return tide, waves\n"
    ),
    "shiplog/land/hill.py": "from shiplog.sea import chart\n",
    "pipelines/__init__.py": "one = 1\ntwo = 2\n",
    "tests/test_it.py": "three = 3\n",
    "pyproject.toml": '[project]\nname = "it"\ndependencies = ["numpy", "jax"]\n',
}  # fmt: skip


@pytest.fixture
def counted(tmp_path):
    for name, text in TREE.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return house.rows(tmp_path)


def test_a_tree_is_counted(counted):
    assert counted["files"] == "8"
    assert counted["lines of shiplog"] == "17"
    assert counted["lines of pipelines"] == "2"
    assert counted["longest file"] == "7 (sea.waves.swell)"
    assert counted["longest function"] == "7 (rise)"
    assert counted["functions"] == "4"
    assert counted["functions with a docstring"] == "2"
    assert counted["functions with a formula"] == "1"
    assert counted["names that are public functions of several modules"] == "1"  # rise
    assert counted["dependencies"] == "2"


def test_rooms_arrows_and_levels(counted):
    """chart → tide → waves and chart → waves; what a room imports of itself is no arrow."""
    kind = "rooms, arrows, levels; functions, with a formula"
    assert counted[f"sea: {kind}"] == "3, 3, 3; 4, 1"
    assert counted[f"land: {kind}"] == "1, 0, 1; 0, 0"


def test_a_circle_of_rooms_ends():
    assert house.levels({"a": {"b"}, "b": {"a"}}) == 2


@pytest.mark.parametrize(
    ("docstring", "formula"),
    [
        ("log Z = -½ rᵀ S⁻¹ r", True),
        ("z ~ N(0, R)", True),
        ("Sum.\n\n    Σ_s w_s", True),
        ("x ← x + d", True),
        ("argmin over x", True),
        ("Accelerations [S, 3J] in m/s² of `step == size`.", False),
        ("The largest of both, a=b without spaces.", False),
        ("", False),
    ],
)
def test_what_a_formula_is(docstring, formula):
    assert house.has_formula(docstring) is formula
