"""Published particle filters on the work of one MCL step: the same motion, the same weights, systematic resampling."""

import datetime

import numpy as np
import pytest

from rfiddesign.estimators import mcl
from tests.estimators.numpy_mcl import NumpyMcl, track

# Steps of the recording that the peers are given.
N_PEER_STEPS = 200


def numpy_float32(scene, twin_class=NumpyMcl):
    """Estimates of the numpy filter over the first steps of the recording."""
    estimates = np.empty((N_PEER_STEPS + 1, mcl.N_ESTIMATE))
    twin = twin_class(scene.ready, scene.poses[0], np.random.Generator(np.random.SFC64(3)), np.float32)
    track(twin, scene.recording, 0, N_PEER_STEPS, estimates)
    return estimates


class _Formulas:
    """Motion and log weight of poses (n, 3), as whoever writes a model for a package would put them."""

    def __init__(self, scene):
        self.recording = scene.recording
        _, self.positions_mm, self.whitening, noise, rules, *_ = scene.ready.model
        self.deviations, self.inner, self.tail = np.sqrt(noise[:, 0]), rules[0], rules[1]
        self.rng = np.random.Generator(np.random.SFC64(3))

    def moved(self, step, x):
        d = self.recording.odometry[step] + self.deviations * self.rng.standard_normal(x.shape)
        cosine, sine = np.cos(x[:, 2]), np.sin(x[:, 2])
        moved = np.empty_like(x)
        moved[:, 0] = x[:, 0] + cosine * d[:, 0] - sine * d[:, 1]
        moved[:, 1] = x[:, 1] + sine * d[:, 0] + cosine * d[:, 1]
        moved[:, 2] = x[:, 2] + d[:, 2]
        return moved

    def log_weights(self, step, x):
        recording, inner, tail = self.recording, self.inner, self.tail
        log_weights = np.zeros(len(x))
        cosine, sine = np.cos(x[:, 2]), np.sin(x[:, 2])
        for row in range(recording.read_start[step], recording.read_start[step + 1]):
            a, (tag_x, tag_y) = recording.read_antenna[row], recording.read_tag_mm[row]
            dx, dy = tag_x - x[:, 0], tag_y - x[:, 1]
            z = np.stack([cosine * dx + sine * dy, cosine * dy - sine * dx]) - self.positions_mm[a][:, None]
            squared = ((self.whitening[a] @ z) ** 2).sum(axis=0)
            log_weights += np.where(squared < inner * inner, 0.0, tail - 0.5 * squared)
        return log_weights


def particles_bootstrap(scene):
    """The bootstrap filter of the package `particles` (N. Chopin) with its systematic resampling and moments."""
    particles = pytest.importorskip("particles")
    from particles.collectors import Moments

    formulas = _Formulas(scene)

    class Localization(particles.FeynmanKac):
        def M0(self, N):
            return np.tile(scene.poses[0], (N, 1))

        def M(self, t, xp):
            return formulas.moved(t - 1, xp)

        def logG(self, t, xp, x):
            return np.zeros(len(x)) if t == 0 else formulas.log_weights(t - 1, x)

    filter_ = particles.SMC(
        fk=Localization(T=N_PEER_STEPS + 1), N=scene.n_particles, resampling="systematic", ESSrmin=1.0,
        collect=[Moments()],
    )  # fmt: skip
    filter_.run()
    return np.array([moments["mean"] for moments in filter_.summaries.moments])


def stonesoup_filter(scene):
    """Predictor, updater and systematic resampler of the package `stonesoup`, with its mean and covariance."""
    pytest.importorskip("stonesoup")
    from stonesoup.models.measurement.base import MeasurementModel
    from stonesoup.models.transition.base import TransitionModel
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    formulas, step = _Formulas(scene), 0

    class Motion(TransitionModel):
        ndim_state = 3

        def function(self, state, noise=False, **options):
            return StateVectors(formulas.moved(step, np.asarray(state.state_vector, float).T).T)

        def rvs(self, num_samples=1, **options):
            raise RuntimeError("the noise is part of the motion")

        def pdf(self, state1, state2, **options):
            raise RuntimeError("a bootstrap filter has no need of it")

    class Reads(MeasurementModel):
        ndim_state, ndim_meas, mapping = 3, 1, (0, 1, 2)

        def function(self, state, noise=False, **options):
            raise RuntimeError("reads are weighed, not predicted")

        rvs = pdf = function

        def logpdf(self, measurement, state, **options):
            return formulas.log_weights(step, np.asarray(state.state_vector, float).T)

    n = scene.n_particles
    predictor, weighing = ParticlePredictor(Motion()), ParticleUpdater(Reads())
    resampler = SystematicResampler()
    begin = datetime.datetime(2026, 1, 1)
    start = StateVectors(np.tile(scene.poses[0][:, None], (1, n)))
    state = ParticleState(start, log_weight=np.full(n, -np.log(n)), timestamp=begin)
    means = [scene.poses[0]]
    for step in range(N_PEER_STEPS):
        now = begin + datetime.timedelta(seconds=0.05 * (step + 1))
        prediction = predictor.predict(state, timestamp=now)
        weighed = weighing.update(SingleHypothesis(prediction, Detection(np.array([[0.0]]), timestamp=now)))
        means.append(np.asarray(weighed.mean, float).ravel())
        _ = weighed.covar
        state = resampler.resample(weighed)
    return np.array(means)


def filterpy_resampling(scene):
    """The same numpy filter with `filterpy`'s systematic resampling, as its handbook shows."""
    resample = pytest.importorskip("filterpy.monte_carlo").systematic_resample

    class WithFilterpy(NumpyMcl):
        def _resample(self, weights, total, log_weights, antenna, tags):
            drawn = resample((weights / total).astype(float))
            self.x, self.y, self.heading = self.x[drawn], self.y[drawn], self.heading[drawn]

    return numpy_float32(scene, WithFilterpy)
