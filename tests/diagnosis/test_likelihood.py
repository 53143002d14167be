"""The algebra of evidence against dense Gaussians, and sizes learnt from draws of the model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from shiplog.diagnosis.linear.linear_segments import AT_A_TIME, Linear, Path, acting
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise import likelihood, noise_estimate, part_products
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.nominal.nominal_reference import inflation, marginal, nominal_information
from shiplog.voyages.rows.timescale import NODE_STEP

NOISE = np.array([0.02, 0.01, 0.03, 0.015, 0.004, 0.002])
PROCESS_NOISE = ProcessNoise(NOISE, np.array([0.8, 0.5, 0.3]), 5.0, np.full(6, 1.7))


def linear(segments: int, bins: int = 4, nodes: int = 3, columns: int = 2, seed: int = 0) -> Linear:
    """Random columns; a few observations unused."""
    rng = np.random.default_rng(seed)
    shape = (segments, bins, 6)
    used = np.ones(shape, dtype=bool)
    used[0, 1] = False
    cut = Cut(np.arange(segments), np.zeros(shape), used, np.zeros((segments, 1, 1)),
              np.zeros(segments, dtype=int), 0.2)  # fmt: skip
    size = 6 + 3 * nodes
    z = rng.standard_normal((*shape, size)) * NOISE[:, None] * 5.0
    j = rng.standard_normal((*shape, columns)) * NOISE[:, None] * 3.0
    path = Path(np.zeros((segments, 6)), np.zeros((segments, 3, nodes)))
    return Linear(cut, path, rng.standard_normal(shape) * NOISE, z, j)


def covariance(process_noise: ProcessNoise, nodes: int, segment: int = 0) -> np.ndarray:
    """Of z, written out: free start, and accelerations that stay for `time` seconds."""
    at = NODE_STEP * np.arange(nodes)
    stays = np.exp(-np.abs(at[:, None] - at) / process_noise.time)
    whole = np.zeros((6 + 3 * nodes,) * 2)
    whole[:6, :6] = np.diag(process_noise.start**2)
    for channel in range(3):
        part = slice(6 + channel * nodes, 6 + (channel + 1) * nodes)
        whole[part, part] = process_noise.acceleration[channel] ** 2 * stays
    if process_noise.intermittent is not None:
        stays = np.exp(-np.abs(at[:, None] - at) / process_noise.intermittent_time)
        if process_noise.runs is not None:
            stays = stays * process_noise.runs[segment]
        whole[6:, 6:] += np.kron(
            np.outer(process_noise.intermittent, process_noise.intermittent), stays
        )
    return whole


def observed(process_noise: ProcessNoise, bins: int) -> np.ndarray:
    """R of one segment [6B, 6B], bin by bin: a share of each channel's noise lasts into the next
    observations, 2 s apart."""
    whole = np.zeros((6 * bins, 6 * bins))
    for i in range(bins):
        for k in range(bins):
            lasts = process_noise.coloured * np.exp(-2.0 * abs(i - k) / process_noise.fade)
            both = process_noise.noise**2 * (lasts + (1.0 - process_noise.coloured) * (i == k))
            whole[6 * i : 6 * i + 6, 6 * k : 6 * k + 6] = np.diag(both)
    return whole


def _gram(
    given: Linear, process_noise: ProcessNoise, known: ProcessNoise | None = None,
    weight=None, accelerations=None, unit=None,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """G_s of every segment, a part each, and the volume of all; `known` are instruments and
    start, where they are not those of the process noise."""
    count = 0 if accelerations is None else accelerations.shape[-1]
    unit = np.ones(given.j.shape[-1] + count) if unit is None else unit
    passes = list(
        part_products.passes(
            given, known or process_noise, np.arange(len(given.e))[:, None], unit, weight,
            accelerations,
        )
    )  # fmt: skip
    prior = process_noise.inverse_kernels((given.z.shape[-1] - 6) // 3)
    each = [one.gram(prior) for one in passes]
    volume = sum(one.volume for one in each) + sum(one.logdet for one in passes)
    return np.stack([one.G for one in each]), volume


def dense(given: Linear, process_noise: ProcessNoise, fitted: bool = False):
    """Of each segment: the observations used, their columns, and C = R + Z K Zᵀ, explicitly.
    `fitted`: without what the start adds to it."""
    nodes = (given.z.shape[-1] - 6) // 3
    for s in range(len(given.e)):
        kernel = covariance(process_noise, nodes, s)
        if fitted:
            kernel[:6] = 0.0
        used = given.cut.used[s].ravel()
        z = given.z[s].reshape(-1, given.z.shape[-1])[used]
        r = observed(process_noise, given.e.shape[1])[np.ix_(used, used)]
        c = r + z @ kernel @ z.T
        j = given.j[s].reshape(-1, given.j.shape[-1])[used]
        yield given.e[s].ravel()[used], j, c


INTERMITTENT = replace(
    PROCESS_NOISE, intermittent=np.array([0.0, 0.9, -0.4]), intermittent_time=12.0
)
COLOURED = replace(
    PROCESS_NOISE, coloured=np.array([0.9, 0.5, 0.0, 0.3, 0.7, 0.95]),
    fade=np.array([1.0, 8.0, 1.0, 2.0, 3.0, 16.0]),
)  # fmt: skip
# On in the first two nodes of three, in none, and in two that are not of one run.
ON_OFF = replace(
    INTERMITTENT, runs=np.array([[[1, 1, 0], [1, 1, 0], [0, 0, 0]], np.zeros((3, 3)),
                                 [[1, 0, 0], [0, 0, 0], [0, 0, 1]]])
)  # fmt: skip
EACH = pytest.mark.parametrize(
    "process_noise",
    (PROCESS_NOISE, INTERMITTENT, ON_OFF, COLOURED),
    ids=("plain", "intermittent", "on and off", "coloured"),
)


@EACH
def test_gram_is_the_dense_gaussian(process_noise):
    """[e | J]ᵀ C⁻¹ [e | J] with start and acceleration in C. The start is fitted: log |C| is the
    restricted one, log |V| + log |Z₀ᵀ V⁻¹ Z₀| - log |Z₀ᵀ R⁻¹ Z₀|; V is of both noises."""
    given = linear(3)
    found, volume = _gram(given, process_noise)
    for s, (e, j, c) in enumerate(dense(given, process_noise)):
        block = np.concatenate((e[:, None], j), 1)
        assert found[s] == pytest.approx(block.T @ np.linalg.solve(c, block), rel=1e-6)
    logdet = 0.0
    for s, (_, _, v) in enumerate(dense(given, process_noise, fitted=True)):
        used = given.cut.used[s].ravel()
        start = given.z[s].reshape(-1, 15)[used, :6]
        r = observed(process_noise, given.e.shape[1])[np.ix_(used, used)]
        felt = start.T @ np.linalg.solve(v, start) + np.diag(process_noise.start**-2.0)
        logdet += np.linalg.slogdet(v)[1] + np.linalg.slogdet(felt)[1]
        logdet -= np.linalg.slogdet(start.T @ np.linalg.solve(r, start))[1]
    assert volume == pytest.approx(logdet, rel=1e-5)


@EACH
def test_a_square_of_errors_alone_is_that_of_their_gram(process_noise):
    """Of one pass under each size of process noise, with an intermittent force and without."""
    given = linear(3)
    alone = replace(given, j=given.j[..., :0])
    weighed = likelihood.weighed(alone, process_noise)
    for other in (
        process_noise,
        process_noise.times(3.0),
        replace(process_noise, intermittent=np.array([0.1, 2.0, 0.7])),
    ):
        each, volume = likelihood.startless(weighed, process_noise).square(other)
        wanted, whole = _gram(alone, other, process_noise)
        assert each == pytest.approx(wanted[:, 0, 0], rel=1e-9)
        assert volume == pytest.approx(whole, rel=1e-9)


def test_evidence_of_a_size_of_process_noise_is_that_of_the_dense_gaussian():
    """With a start that is nearly known, log N(e; Jd, C) itself: more noise against less."""
    given, d = linear(3), np.array([0.3, -0.7])
    sure = replace(PROCESS_NOISE, start=np.full(6, 1e-4))
    towards = np.concatenate(([1.0], -d))
    found, wanted = [], []
    for process_noise in (sure, sure.times(3.0)):
        each, volume = _gram(given, process_noise)
        found.append(-0.5 * (towards @ each.sum(0) @ towards + volume))
        every = dense(given, process_noise)
        wanted.append(sum(multivariate_normal(mean=j @ d, cov=c).logpdf(e) for e, j, c in every))
    assert abs(wanted[1] - wanted[0]) > 10.0
    assert found[1] - found[0] == pytest.approx(wanted[1] - wanted[0], abs=0.01)


def test_units_scale_columns_and_not_the_error():
    given = linear(2)
    unit = np.array([1e-3, 40.0])
    found, volume = _gram(given, PROCESS_NOISE, unit=unit)
    direct, same = _gram(replace(given, j=given.j * unit), PROCESS_NOISE)
    assert found == pytest.approx(direct, rel=1e-9)
    assert volume == same


@pytest.mark.parametrize("noise_factor", (0.5, 1.0, 2.0))
def test_further_columns_bend_the_observations_as_their_acceleration_does(noise_factor):
    """Given as they are, or as a function that makes those of some segments; units are theirs."""
    given, unit = linear(3), np.array([1.0, 2.0, 1.0, 0.5, 1.0, 3.0])
    accelerations = np.random.default_rng(9).standard_normal((3, 9, 4))
    columns = np.einsum("sbcz,szw->sbcw", given.z[..., 6:], accelerations)
    written_out = replace(given, j=np.concatenate((given.j, columns), -1) * unit)
    process_noise = PROCESS_NOISE.times(noise_factor)
    wanted, volume = _gram(written_out, process_noise)
    found, same = _gram(given, process_noise, accelerations=accelerations, unit=unit)
    assert found == pytest.approx(wanted, rel=1e-6, abs=1e-6)
    assert same == pytest.approx(volume, rel=1e-9)
    weight = np.array([1.0, 0.0, 0.4])
    total = part_products.whole(
        given, process_noise, unit, weight, lambda cut: accelerations[cut.rows]
    )
    assert pytest.approx(np.einsum("s,sij->ij", weight, wanted), rel=1e-6, abs=1e-6) == total.G
    first = next(part_products.passes(given, PROCESS_NOISE, [np.arange(3)], unit,
                                      accelerations=accelerations))  # fmt: skip
    fewer = first.gram(process_noise.inverse_kernels(3), 4)
    assert pytest.approx(wanted.sum(0)[:4, :4], rel=1e-6, abs=1e-6) == fewer.G


def test_less_an_acceleration_is_less_what_it_does():
    given = linear(3)
    accelerations = np.random.default_rng(9).standard_normal((3, 9))
    moved = replace(given, e=given.e + np.einsum("sbcz,sz->sbc", given.z[..., 6:], accelerations))
    assert moved.less(accelerations).e == pytest.approx(given.e, abs=1e-12)


@pytest.mark.parametrize("segments", (0, 1, 32, 71))
def test_what_weights_do_is_the_same_of_some_segments_at_a_time(segments):
    """Weights of all segments, or others in each; never more than some are made at once."""
    rng = np.random.default_rng(segments)
    phi = rng.standard_normal((segments, 9, 4))
    cut = linear(1).cut.pick(np.zeros(segments, dtype=int))
    cut = replace(cut, rows=np.arange(segments))
    asked: list[int] = []

    def made(some: Cut) -> np.ndarray:
        asked.append(len(some))
        return phi[some.rows]

    for weights in (rng.standard_normal(4), rng.standard_normal((segments, 4))):
        found = acting(made, cut, weights)
        assert found.shape == (segments, 9)
        assert found == pytest.approx(acting(phi, cut, weights), abs=1e-12)
    assert max(asked) <= AT_A_TIME


@EACH
def test_one_pass_serves_every_process_noise(process_noise):
    """Sizes of it, and shapes: of a pass that was made with the nominal one, weighted sums."""
    given, weight = linear(4), np.array([1.0, 0.0, 0.4, 1.0])
    if process_noise.runs is not None:  # the fourth as the first: one kernel serves both
        runs = np.concatenate((process_noise.runs, process_noise.runs[:1]))
        process_noise = replace(process_noise, runs=runs)
    made = replace(process_noise, intermittent=None)
    (part,) = part_products.passes(given, made, [np.arange(4)], np.ones(2), weight)
    for noise_factor in (0.5, 2.0, 5.0):
        other = process_noise.times(noise_factor)
        each, _ = _gram(given, other)
        found = part.gram(other.inverse_kernels(3))
        assert pytest.approx(np.einsum("s,sij->ij", weight, each), rel=1e-6) == found.G
        volumes = [_gram(given.pick(np.arange(4) == s), _one(other, s))[1] for s in range(4)]
        alone = [_gram(given.pick(np.arange(4) == s), made)[1] for s in range(4)]
        base = part.gram(made.inverse_kernels(3)).volume
        wanted = base + float(weight @ (np.array(volumes) - np.array(alone)))
        assert found.volume == pytest.approx(wanted, rel=1e-9)


def _one(process_noise: ProcessNoise, segment: int) -> ProcessNoise:
    if process_noise.runs is None:
        return process_noise
    return replace(process_noise, runs=process_noise.runs[segment : segment + 1])


@EACH
def test_start_and_accelerations_are_the_posterior_mean(process_noise):
    """K Zᵀ C⁻¹ (e - J d), written out."""
    given, d = linear(3), np.array([0.3, -0.7])
    found, _ = likelihood.starts_and_accelerations(given, d, process_noise)
    for s, (e, j, c) in enumerate(dense(given, process_noise)):
        kernel = covariance(process_noise, 3, s)
        z = given.z[s].reshape(-1, 15)[given.cut.used[s].ravel()]
        mean = kernel @ z.T @ np.linalg.solve(c, e - j @ d)
        assert found[s] == pytest.approx(mean, rel=1e-5, abs=1e-7)


def test_marginal_is_the_dense_gaussian():
    """Numbers d ~ N(m, Λ⁻¹) integrated out, up to what no prior changes: priors compared."""
    given = linear(3)
    total = part_products.whole(given, PROCESS_NOISE, np.ones(2)).G
    found, wanted = [], []
    for mean, sure in (((0.0, 0.0), (1.0, 4.0)), ((0.5, -1.0), (0.1, 30.0))):
        information = np.diag(sure)
        found.append(marginal(total, information, information @ np.array(mean)))
        e, j, c = (np.concatenate(parts) if i < 2 else parts
                   for i, parts in enumerate(
                       zip(*dense(given, PROCESS_NOISE), strict=True)))  # fmt: skip
        whole = np.zeros((len(e), len(e)))
        at = 0
        for block in c:
            whole[at : at + len(block), at : at + len(block)] = block
            at += len(block)
        whole += j @ np.diag(1.0 / np.array(sure)) @ j.T
        wanted.append(multivariate_normal(mean=j @ np.array(mean), cov=whole).logpdf(e))
    assert found[1] - found[0] == pytest.approx(wanted[1] - wanted[0], abs=1e-4)


def test_an_intermittent_force_acts_on_all_channels_together():
    """Covariance of channel a at node i and b at node k: p_a p_b e^(-|t|/12 s), and the process
    noise's own only within a channel."""
    kernel = INTERMITTENT.kernel(4)
    acceleration, intermittent = INTERMITTENT.acceleration, np.array([0.0, 0.9, -0.4])
    for a in range(3):
        for b in range(3):
            for i, k in ((0, 0), (0, 2), (3, 1)):
                far = abs(i - k) * NODE_STEP
                value = intermittent[a] * intermittent[b] * np.exp(-far / 12.0)
                if a == b:
                    value += acceleration[a] ** 2 * np.exp(-far / 5.0)
                assert kernel[4 * a + i, 4 * b + k] == pytest.approx(value, abs=1e-7)
    noise_factor = INTERMITTENT.times(3.0).kernel(4) - INTERMITTENT.kernel(4)
    assert noise_factor[0, 0] == pytest.approx(
        8.0 * acceleration[0] ** 2
    )  # the intermittent force stays
    assert abs(noise_factor[0, 4]) < 1e-12


def test_precision_is_the_inverse():
    kernel = covariance(INTERMITTENT, 3)
    assert INTERMITTENT.precision(3) @ kernel == pytest.approx(np.eye(15), abs=1e-6)


def test_sizes_are_learnt_from_draws_of_the_model():
    """Both noises as drawn, from a beginning that is wrong by a factor of three."""
    rng = np.random.default_rng(11)
    given = linear(250, bins=10, nodes=5)
    kernel = covariance(PROCESS_NOISE, 5)
    z = rng.multivariate_normal(np.zeros(len(kernel)), kernel, len(given.e))
    d = np.array([0.3, -0.7])
    noise = NOISE * rng.standard_normal(given.e.shape)
    e = np.einsum("sbcz,sz->sbc", given.z, z) + given.j @ d + noise
    e[~given.cut.used] = 1e3  # nobody looks there
    begin = replace(PROCESS_NOISE, noise=NOISE * 3.0, acceleration=PROCESS_NOISE.acceleration / 3.0)
    found = noise_estimate.estimate(replace(given, e=e), d, begin, rounds=25)
    assert found.noise == pytest.approx(NOISE, rel=0.15)
    assert found.acceleration == pytest.approx(PROCESS_NOISE.acceleration, rel=0.15)
    assert found.time == PROCESS_NOISE.time and (found.start == PROCESS_NOISE.start).all()
    assert (found.coloured <= 0.2).all()


def test_sizes_learnt_are_the_likeliest():
    """Within five rounds, from a beginning that is wrong by a factor of ten: at another size of any
    of them, the dense likelihood is less. White noise, whose colour is not estimated."""
    rng = np.random.default_rng(13)
    given = linear(20, bins=10, nodes=5)
    used = rng.random(given.e.shape[:2]) > 0.3  # hardly ever whole
    given = replace(given, cut=replace(given.cut, used=np.repeat(used[..., None], 6, -1)))
    kernel = covariance(PROCESS_NOISE, 5)
    z = rng.multivariate_normal(np.zeros(len(kernel)), kernel, len(given.e))
    noise = NOISE * rng.standard_normal(given.e.shape)
    given = replace(given, e=np.einsum("sbcz,sz->sbc", given.z, z) + noise)
    begin = replace(
        PROCESS_NOISE, noise=NOISE * 10.0, acceleration=PROCESS_NOISE.acceleration / 10.0
    )
    found = noise_estimate.estimate(given, np.zeros(2), begin, rounds=5)

    def log_density(sizes):
        tried = replace(found, noise=sizes[:6], acceleration=sizes[6:])
        return sum(
            multivariate_normal.logpdf(e, np.zeros(len(e)), c) for e, _, c in dense(given, tried)
        )

    at = np.concatenate((found.noise, found.acceleration))
    here = log_density(at)
    for i in range(9):
        for by in (0.98, 1.02):
            assert log_density(np.where(np.arange(9) == i, by * at, at)) < here


def test_colour_of_the_noise_is_learnt_from_draws_of_it():
    """Four fifths of one channel's noise last for 4 s; the others' is white. A few segments with
    holes take no part, and a campaign of nothing else says nothing."""
    rng = np.random.default_rng(12)
    given = linear(400, bins=15, nodes=5)
    share = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.8])
    true = replace(PROCESS_NOISE, coloured=share, fade=np.full(6, 4.0))
    kernel, d = covariance(true, 5), np.array([0.3, -0.7])
    z = rng.multivariate_normal(np.zeros(len(kernel)), kernel, len(given.e))
    noise = rng.multivariate_normal(np.zeros(90), observed(true, 15), len(given.e))
    e = np.einsum("sbcz,sz->sbc", given.z, z) + given.j @ d + noise.reshape(given.e.shape)
    drawn, found = replace(given, e=e), PROCESS_NOISE
    for _ in range(4):
        found = noise_estimate.estimate(drawn, d, found, rounds=6)
    assert found.coloured[5] == pytest.approx(0.8, abs=0.1) and found.fade[5] == 4.0
    assert (found.coloured[:5] <= 0.2).all()
    assert found.noise == pytest.approx(NOISE, rel=0.1)
    holes = replace(
        drawn, cut=replace(drawn.cut, used=drawn.cut.used & (np.arange(15) != 7)[:, None])
    )
    assert (noise_estimate.estimate(holes, d, PROCESS_NOISE, rounds=1).coloured == 0.0).all()


def test_one_campaign_is_believed_less_where_voyages_disagree():
    """κ follows the scatter between voyages: twelve voyages, each with coefficients of its own."""
    rng = np.random.default_rng(2)
    count, sure = 24, 400.0  # each voyage knows its numbers to 1/20
    known, held = np.ones(3), np.zeros(3)

    def grams(scatter):
        each = np.zeros((count, 4, 4))
        for s in range(count):
            d = 0.2 + scatter * rng.standard_normal(3) + rng.standard_normal(3) / np.sqrt(sure)
            j = np.sqrt(sure) * np.eye(3)
            block = np.concatenate(((j @ d)[:, None], j), 1)
            each[s] = block.T @ block
        return each

    alike = grams(0.0)
    assert inflation(alike, known, held) == 2.0  # the least that is tried
    assert inflation(grams(0.4), known, held) == 32.0
    assert inflation(grams(0.4)[:2], known, held) == 11.0  # too few to tell


def test_a_campaign_counts_for_a_part_of_itself():
    """Covariance (G / κ + K)⁻¹ about what both it and the run's own coefficients ask for."""
    rng = np.random.default_rng(5)
    j = rng.standard_normal((40, 4))
    total, known, held = j.T @ j, np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.0, -0.2])
    information, pull = nominal_information(total, 4.0, known, held)
    plain = np.linalg.inv(total[1:, 1:] / 4.0 + np.diag(known))
    assert np.linalg.inv(information) == pytest.approx(plain)
    assert np.linalg.solve(information, pull) == pytest.approx(plain @ (total[1:, 0] / 4.0 + held))
