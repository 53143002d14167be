"""The recording of the paper's figures: all at a glance, then each by itself."""

from recordings import views

from shiplog.report.viewer import album


def test_all_pictures_stand_beside_the_text_and_each_has_a_tab():
    found = views(album.blueprint(["errors", "winds", "tracks"]))
    assert [(v["name"], len(v["in"])) for v in found] == [
        ("summary", 2), ("errors", 3), ("winds", 3), ("tracks", 3),  # in the overview
        ("errors", 1), ("winds", 1), ("tracks", 1),
    ]  # fmt: skip
    assert [v["origin"] for v in found[1:4]] == [v["origin"] for v in found[4:]]


def test_a_text_alone_is_the_whole_recording():
    assert [v["name"] for v in views(album.blueprint([]))] == ["summary"]
