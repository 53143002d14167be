"""The paper's recipe against a plain reading of it; the fast one against what it promises."""

import copy

import pytest
import torch
from small_networks import by_autograd, network, windows

from shiplog.models.network_shape import Shape
from shiplog.training.network import network_gradient
from shiplog.training.network.network_training import fast, paper, shortened
from shiplog.training.settings import random_streams
from shiplog.training.settings.run_config import Config, Fast, Paper
from shiplog.voyages.windows.split_settings import Split

SHAPE = Shape(3, width=12, depth=2)


def setting(dtype=torch.float64):
    learnt, held = windows(7, 15, seed=1), windows(3, 15, seed=2)
    model = network(SHAPE, learnt, seed=3)
    batches = [network_gradient.batch(w, model.scaling, SHAPE, dtype) for w in (learnt, held)]
    return learnt, held, model, batches


def plainly(model, learnt, epochs, settings, seed):
    """Sec. 4.3 as it is written: the L2 term in the loss, autograd, one random split an epoch."""
    model = copy.deepcopy(model)
    adam = torch.optim.Adam(model.parameters(), lr=settings.learning_rate)
    stream = random_streams.generator(seed, "batches")
    for _ in range(epochs):
        for rows in torch.tensor_split(torch.randperm(len(learnt), generator=stream), 3):
            adam.zero_grad()
            penalty = sum((p**2).sum() for p in model.weights)
            loss = by_autograd(model, learnt.pick(rows.numpy())) + settings.regularisation * penalty
            loss.backward()
            adam.step()
    return model


def test_the_papers_recipe_is_adam_on_loss_plus_l2_in_three_subsets():
    learnt, _, model, batches = setting()
    settings = Paper(learning_rate=1e-3, regularisation=0.5, most_epochs=6)
    progress = paper(model, *batches, settings, seed=4)
    expected = plainly(model, learnt, 6, settings, seed=4)
    for mine, theirs in zip(progress.weights, expected.weights, strict=True):
        assert torch.allclose(mine, theirs, rtol=1e-7, atol=1e-10)


def test_the_history_is_smoothed_and_the_best_weights_are_those_of_the_smallest_validation():
    _, held, model, batches = setting()
    progress = paper(model, *batches, Paper(learning_rate=3e-3, most_epochs=40), seed=0)
    epochs, _, validation, smoothed = zip(*progress.history, strict=True)
    assert epochs == tuple(range(41))
    assert validation[0] == pytest.approx(by_autograd(model, held).item())
    average = validation[0]
    for value, displayed in zip(validation[1:], smoothed[1:], strict=True):
        average = 0.1 * value + 0.9 * average
        assert displayed == pytest.approx(average)
    again = network_gradient.loss_only(progress.best_weights, batches[1], model.scaling, SHAPE)
    assert again == pytest.approx(min(validation)) == pytest.approx(progress.best)


def test_training_stops_once_the_validation_loss_has_risen_and_not_before():
    _, _, model, batches = setting()
    settings = Paper(learning_rate=3e-2, regularisation=0.0, least_epochs=30, rise=0.02,
                     most_epochs=600)  # fmt: skip
    progress = paper(model, *batches, settings, seed=0)
    losses = [row[2] for row in progress.history]

    def risen(epoch):
        lowest = min(losses[: epoch + 1])
        return losses[epoch] > 0.02 * (losses[0] - lowest) + lowest

    last = len(losses) - 1
    assert 31 < last < 600
    assert risen(last)
    assert not any(risen(epoch) for epoch in range(31, last))


def test_training_goes_on_while_the_least_epochs_are_not_exceeded():
    _, _, model, batches = setting()
    settings = Paper(learning_rate=3e-2, regularisation=0.0, least_epochs=200, rise=0.02)
    progress = paper(model, *batches, settings, seed=0)
    assert progress.epoch == 201  # risen long before, as the test above shows


def test_the_defaults_are_table_5_and_section_4_3():
    assert Paper().model_dump() == {
        "learning_rate": 1e-4, "regularisation": 1e-2, "subsets": 3, "smoothing": 0.1,
        "least_epochs": 10_000, "rise": 0.1, "most_epochs": None,
    }  # fmt: skip


def test_a_resumed_training_is_the_uninterrupted_one_to_the_last_bit():
    *_, model, batches = setting(torch.float32)
    model = model.float()
    settings = Paper(learning_rate=1e-3, most_epochs=12)
    kept = []
    whole = paper(
        model,
        *batches,
        settings,
        seed=5,
        every=5,
        checkpoint=lambda p: kept.append(copy.deepcopy(p)),
    )
    assert [p.epoch for p in kept] == [5, 10]
    resumed = paper(model, *batches, settings, seed=99, resume=kept[0])
    assert resumed.history == whole.history
    for a, b in zip(whole.weights + whole.best_weights, resumed.weights + resumed.best_weights,
                    strict=True):  # fmt: skip
        assert torch.equal(a, b)


def test_the_fast_recipe_learns_repeats_itself_and_depends_on_its_seed():
    *_, model, batches = setting(torch.float32)
    model = model.float()
    settings = Fast(iterations=25, warm_epochs=5)
    first = fast(model, *batches, settings, seed=0)
    again = fast(model, *batches, settings, seed=0)
    other = fast(model, *batches, settings, seed=1)
    losses = [row[2] for row in first.history]
    assert first.best == min(losses) < losses[0]
    assert first.history[1:] == again.history[1:]
    assert other.history[1:] != first.history[1:]
    trained = network_gradient.loss_only(first.best_weights, batches[1], model.scaling, SHAPE)
    assert trained == pytest.approx(first.best, rel=1e-6)
    learnt = [row[1] for row in first.history[1:]]
    assert learnt[-1] < 0.5 * network_gradient.loss_only(
        list(model.weights), batches[0], model.scaling, SHAPE
    )


def test_shortened_windows_are_the_same_rows_cut_up():
    data = network_gradient.Batch(
        torch.arange(11 * 2 * 3.0).view(11, 2, 3), torch.zeros(11, 2, 1), torch.ones(10, 2)
    )
    pieces = shortened(data, 5)
    assert pieces.velocity.shape == (6, 4, 3)
    assert torch.equal(pieces.velocity[:, :2], data.velocity[:6])
    assert torch.equal(pieces.velocity[:, 2:], data.velocity[5:11])
    assert pieces.dt.shape == (5, 4)


@pytest.mark.parametrize(("recipe", "wind"), [("paper", "angle"), ("fast", "components")])
def test_each_recipe_has_its_wind_input(recipe, wind):
    config = Config(recipe=recipe, split=Split(training=("a",), validation=("b",)))
    assert config.network.wind_input == wind
