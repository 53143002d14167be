"""VOYAGE:SECONDS."""

import pytest

from shiplog.exceptions import ShiplogError
from shiplog.voyages.store import moments


def test_a_moment_is_a_voyage_and_seconds():
    assert moments.parse("season2_1:1234") == ("season2_1", 1234.0)
    assert moments.parse("a:b:0.5") == ("a:b", 0.5)  # a name may have a colon


@pytest.mark.parametrize("text", ["season2_1", "season2_1:", ":12", "season2_1:noon", "a:nan", ""])
def test_anything_else_is_said_in_a_sentence(text):
    with pytest.raises(ShiplogError, match="is no voyage and seconds") as refused:
        moments.parse(text)
    assert "VOYAGE:SECONDS" in refused.value.hint
