"""Seeds that are trained as one batch against each of them trained alone."""

import copy

import pytest
import torch
from small_networks import network, windows

from shiplog.models.network_shape import Shape
from shiplog.training.network import network_gradient
from shiplog.training.network.job import Training
from shiplog.training.network.network_training import paper, paper_done
from shiplog.training.network.seeds_together import SeedsTogether, advance
from shiplog.training.settings.run_config import Config, Paper
from shiplog.voyages.windows.split_settings import Split

SHAPE = Shape(3, width=12, depth=2)
CPU = torch.device("cpu")


def training(seed, settings, dtype=torch.float64):
    """A seed with weights and, as with jitter, windows of its own; 7 are not divisible by 3."""
    learnt, held = windows(7, 15, seed=10 + seed), windows(3, 15, seed=2)
    model = network(SHAPE, windows(7, 15, seed=1), seed=20 + seed)
    batches = [network_gradient.batch(w, model.scaling, SHAPE, dtype) for w in (learnt, held)]
    split = Split(training=("a",), validation=("b",))
    config = Config(recipe="paper", paper=settings, split=split)
    return Training(config, seed, model.to(dtype), *batches)


def alone(one, **options):
    return paper(one.model, one.training, one.validation, one.config.paper, one.seed, **options)


def together(trainings, **options):
    run = SeedsTogether(trainings, CPU, **options)
    ends = [seed for _, ended in advance([run]) for seed in ended]
    return run.progress, ends


def assert_same(one, other):
    assert one.epoch == other.epoch and one.steps == other.steps
    for a, b in zip(one.history, other.history, strict=True):
        assert a == pytest.approx(b, rel=1e-9, nan_ok=True)
    for mine, theirs in ((one.weights, other.weights), (one.best_weights, other.best_weights),
                         (one.moments, other.moments)):  # fmt: skip
        for a, b in zip(mine, theirs, strict=True):
            assert torch.allclose(a, b, rtol=1e-7, atol=1e-10)


def test_each_of_several_seeds_is_trained_as_it_would_be_alone():
    settings = Paper(learning_rate=3e-3, regularisation=0.5, most_epochs=9)
    trainings = [training(seed, settings) for seed in (0, 3, 5)]
    progress, _ = together(trainings)
    for one in trainings:
        assert_same(progress[one.seed], alone(one))


def test_a_seed_that_ends_leaves_the_batch_and_the_others_go_on():
    settings = Paper(learning_rate=1e-2, regularisation=0.0, least_epochs=5, most_epochs=120)
    trainings = [training(seed, settings) for seed in (0, 1, 2)]
    progress, ends = together(trainings)
    lengths = {seed: one.epoch for seed, one in progress.items()}
    assert len(set(lengths.values())) > 1
    assert ends == sorted(lengths, key=lambda seed: (lengths[seed], seed))
    assert lengths == {one.seed: alone(one).epoch for one in trainings}


def test_seeds_go_on_from_checkpoints_of_their_own_even_with_different_lengths():
    settings = Paper(learning_rate=1e-3, most_epochs=12)
    trainings = [training(seed, settings) for seed in (0, 1)]
    kept = {0: alone(trainings[0], pause=4)}  # a checkpoint of the other body
    written = []
    progress, _ = together(
        trainings,
        resumed=copy.deepcopy(kept),
        checkpoint=lambda seed, one: written.append((seed, copy.deepcopy(one))),
        every=5,
    )
    for one in trainings:
        assert_same(progress[one.seed], alone(one))
    assert [(seed, one.epoch) for seed, one in written] == [(0, 5), (1, 5), (0, 10), (1, 10)]
    for seed, one in written:  # and the other body goes on from this one's
        assert_same(alone(trainings[seed], resume=copy.deepcopy(one)), progress[seed])


def test_a_seed_that_diverges_leaves_the_others_as_they_are():
    settings = Paper(learning_rate=1e-3, most_epochs=5)
    trainings = [training(seed, settings) for seed in (0, 1)]
    with torch.no_grad():
        trainings[0].model.weights[-1].fill_(float("inf"))
    progress, _ = together(trainings)
    assert progress[0].epoch == 1 and paper_done(progress[0], settings)
    assert_same(progress[1], alone(trainings[1]))


def test_several_runs_take_turns():
    short, long = Paper(most_epochs=2), Paper(most_epochs=4)
    runs = [SeedsTogether([training(0, one)], CPU) for one in (short, long)]
    order = [runs.index(run) for run, _ in advance(runs)]
    assert order == [0, 1, 0, 1, 1, 1]


def test_a_checkpoint_at_the_end_of_a_training_is_its_end():
    """As it is left by a kill between the last checkpoint and the finished file."""
    settings = Paper(most_epochs=2)
    trainings = [training(seed, settings) for seed in (0, 1)]
    ended, _ = together(trainings[:1])
    run = SeedsTogether(trainings, CPU, ended)
    assert run.running == (1,)
    assert [seed for _, over in advance([run]) for seed in over] == [0, 1]


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU that torch can use")
def test_a_gpu_trains_as_the_processor_does():
    settings = Paper(learning_rate=1e-3, regularisation=0.5, most_epochs=9)
    trainings = [training(seed, settings) for seed in (0, 1, 2)]
    run = SeedsTogether(trainings, torch.device("cuda"))
    for _ in advance([run]):
        pass
    for one in trainings:
        assert_same(run.progress[one.seed], alone(one))
