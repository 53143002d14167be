"""A run's colour follows from its name, and no two things of one picture share one."""

from itertools import combinations

from shiplog.report import colours


def test_a_run_looks_the_same_alone_and_in_any_company():
    alone = {name: colours.colours([name])[name] for name in ("mmg", "ref", "d-ref", "hybrid")}
    assert len(set(alone.values())) == 4
    for pair in combinations(alone, 2):
        for order in (pair, pair[::-1]):
            assert colours.colours(order) == {name: alone[name] for name in order}


def test_a_label_has_the_colour_of_its_run():
    found = colours.colours(["mmg (physics)", "ref (ref)"])
    assert list(found.values()) == [colours.BLUE, colours.GREEN]


def test_the_extended_model_has_a_colour_that_no_other_has():
    names = [f"run {i}" for i in range(6)]
    found = colours.colours([*names, "run 7"], extended=["run 7"])
    assert found["run 7"] == colours.EXTENDED
    assert colours.EXTENDED not in colours.MODELS
    assert len(set(found.values())) == 7  # six that ask for what they like, none shared


def test_more_models_than_colours_are_all_drawn():
    found = colours.colours([f"run {i}" for i in range(20)])
    assert len(found) == 20
    assert set(found.values()) == set(colours.MODELS)


def test_two_that_ask_for_one_colour_are_told_apart_in_any_order():
    both = ["ref", "feedforward"]  # both green when alone
    assert colours.colours(both[::-1]) == colours.colours(both)
    assert len(set(colours.colours(both).values())) == 2


def test_what_was_measured_and_the_parts_of_the_force_are_in_no_models_colour():
    models = {*colours.MODELS, colours.EXTENDED}
    others = {*colours.ACTUATORS, *colours.FORCES.values(), *colours.OTHER_FORCES}
    assert not models & {*others, colours.MEASURED, colours.WIND, colours.CURRENT}


def luminance(colour):
    """Relative luminance, as WCAG 2.2 defines it."""
    parts = [part / 255.0 for part in colour[:3]]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_a_legend_reads_on_a_dark_ground_and_on_a_light_one():
    """3 is WCAG's least for graphics. Rerun's dark legend is black, its light one white."""
    assert contrast((0, 0, 0), (255, 255, 255)) == 21.0
    drawn = [*colours.ACTUATORS, *colours.FORCES.values(), *colours.OTHER_FORCES]
    for colour in {*drawn, colours.NAMED_FORCE} - {colours.MEASURED}:  # that is named "(black)"
        assert contrast(colour, (0, 0, 0)) >= 3.0, colour
        assert contrast(colour, colours.PAPER) >= 3.0, colour


def test_words_and_what_was_measured_read_on_paper():
    assert contrast(colours.TEXT, colours.PAPER) >= 7.0 <= contrast(colours.MEASURED, colours.PAPER)


def test_a_colour_in_the_web():
    assert colours.web(colours.BLUE) == "#0072b2"


def test_one_that_gives_way_takes_no_colour_that_another_asks_for():
    found = colours.colours(["feedforward", "ref", "mmg"])  # two ask for green, one for blue
    assert (found["feedforward"], found["mmg"]) == (colours.GREEN, colours.BLUE)
    assert found["ref"] == colours.PURPLE  # the first that is free
