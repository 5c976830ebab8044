"""Monte-Carlo localization (hf_multireader_mcl, Algorithm 1) on arrays; see `_particle_kernels` for their layout."""

import numpy as np

from rfiddesign.estimators._estimate_kernels import estimate
from rfiddesign.estimators._evidence_kernels import N_READ, gather, gather_nothing_seen, room_for_evidence
from rfiddesign.estimators._particle_kernels import HEADING, X, Y, load, resample, store, turn
from rfiddesign.estimators._regularize_kernels import (
    DUE,
    MOST_TURN_VARIANCE,
    bandwidth_due,
    covariance_ahead,
    move_moments,
    predict_apart,
    remember,
    root_of,
)
from rfiddesign.estimators._scatter_kernels import reinitialize, restart_in_region
from rfiddesign.estimators._temper_kernels import LEAST_SHARE, best_of, temper
from rfiddesign.estimators._weigh_kernels import weigh
from rfiddesign.models._motion_kernels import step_deviations, step_variances
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import binary_angle, sin_cos, small_binary_angle
from rfiddesign.numerics._noise_kernels import STREAM_PREDICT, key_halves, random_triple, standard_normal, step_key

_F = np.float32
_U = np.uint32
_LOG_2 = _F(0.6931472)


@leaf_kernel
def predict(key, step, odometry, row, noise, drawn, headings, cloud):
    """Line 3: move each drawn particle by an odometry increment plus noise (eq. 1) into the cloud.

    The increment is a row of `odometry` (n, 3), in the robot's frame; `noise` (3, 3) as in `Motion.noise`.
    """
    deviations = step_deviations(noise, odometry[row, 0], odometry[row, 1], odometry[row, 2])
    width, room = cloud.shape[1], drawn.shape[1]
    low, high = key_halves(step_key(key, STREAM_PREDICT, step))
    dx, dy, turned = _F(odometry[row, 0]), _F(odometry[row, 1]), binary_angle(odometry[row, 2])
    sx, sy, sh = _F(deviations[0]), _F(deviations[1]), _F(deviations[2])
    # Two loops, so that the constants of each stay in registers.
    for i in range(0, width, LANES):
        for_x, for_y, for_heading = random_triple(low, high, lanes.count_up(_U(i)))
        lanes.store(cloud, X * width + i, fma(standard_normal(for_x), sx, dx))
        lanes.store(cloud, Y * width + i, fma(standard_normal(for_y), sy, dy))
        lanes.store(cloud, HEADING * width + i, standard_normal(for_heading) * sh)
    for i in range(0, width, LANES):
        forward, sideways = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        turn_noise = small_binary_angle(lanes.load(cloud, HEADING * width + i))
        heading = lanes.load(headings, i)
        s, c = sin_cos(heading)
        lanes.store(cloud, X * width + i, lanes.load(drawn, i) + fma(c, forward, -(s * sideways)))
        lanes.store(cloud, Y * width + i, lanes.load(drawn, room + i) + fma(s, forward, c * sideways))
        turn(lanes.add(lanes.add(heading, turned), turn_noise), cloud, i)


@leaf_kernel
def move(key, step, odometry, row, noise, keeps_moments, drawn, headings, cloud, about):
    """`predict`, or that together with the Liu-West noise that is due; moves along what is known of the particles."""
    if not keeps_moments:
        predict(key, step, odometry, row, noise, drawn, headings, cloud)
        return
    increment = (odometry[row, 0], odometry[row, 1], odometry[row, 2])
    variances = step_variances(noise, increment[0], increment[1], increment[2])
    due = about[0, DUE]
    if due > 0.0 and due * about[0, 8] + variances[2] < MOST_TURN_VARIANCE:
        root = root_of(covariance_ahead(about, due, increment, variances))
        predict_apart(key, step, increment, root, about, drawn, headings, cloud)
    else:
        predict(key, step, odometry, row, noise, drawn, headings, cloud)
    move_moments(about, increment, variances)


@leaf_kernel
def update(key, step, n_particles, reads, n_reads, n_evidence, rules, table, cloud, drawn, headings, about, out, row):
    """Lines 4-13 for the reads of one step, from the cloud to `drawn`; writes the estimate to a row of `out`.

    Parameters
    ----------
    reads : (n_evidence or more, N_READ) float32, see there: n_reads reads, then tags that were not read; with a table,
        whitening is the rotation to the antenna's axes.
    rules : (inner_radius, log_tail, log_alpha, cell_mm of the table, whether all particles restart in the region,
        1 / (2 w) of `soft_discs`, squared bandwidth of the Liu-West kernel, most variance of a position that it is for,
        least effective share of the particles that is not tempered, squared bandwidth of the moves of tempering);
        log_alpha = -inf: no reinitialization; bandwidth or share 0: no regularization, no tempering.
    table : (n_tables, n, m) float32 log probabilities about the antenna; (n, 4, 1): discs, see `soft_discs`; without
        cells the likelihood is that of eq. 6.
    cloud : (N_FIELDS, width) float32.
    drawn, headings : see `resample`.
    about : see `_regularize_kernels`.
    out : (n, N_ESTIMATE).
    """
    weigh(reads, n_evidence, rules, table, cloud)
    total, lowest = estimate(n_particles, cloud, out, row)
    if n_evidence == 0:
        store(cloud, drawn, headings)
        remember(out, row, 0.0, about)
        return
    log_alpha = _F(rules[2])
    is_doubted, is_lost = lowest < log_alpha, False
    if is_doubted and n_reads > 0 and rules[4] > 0.0:
        best = best_of(n_particles, cloud)
        # What contradicts nothing may still be on the border of the field, at half the chance, for every row.
        is_lost = best < log_alpha - _F(n_evidence) * _LOG_2
    if rules[LEAST_SHARE] > 0.0 and not is_lost:
        total = temper(
            key, step, n_particles, total, reads, n_evidence, rules, table, cloud, drawn, headings, about, out, row
        )  # fmt: skip
    resample(key, step, n_particles, total, is_doubted, cloud, drawn, headings)
    remember(out, row, 0.0 if is_lost else bandwidth_due(out, row, n_particles, rules), about)
    if is_lost:
        restart_in_region(key, step, reads, n_reads, table, rules[3], n_particles, drawn, headings)
        # Lanes beyond the last particle stay near the others.
        for m in range(n_particles, cloud.shape[1]):
            drawn[0, m], drawn[1, m] = drawn[0, n_particles - 1], drawn[1, n_particles - 1]
            headings[m] = headings[n_particles - 1]
        load(drawn, headings, cloud)
        estimate(n_particles, cloud, about, 0)
    elif is_doubted and n_reads > 0 and rules[4] == 0.0:
        reinitialize(key, step, log_alpha, reads, n_reads, n_particles, drawn, headings)


@kernel
def predict_step(key, step, odometry, row, model, arrays):
    """`predict` for particles that lie in `drawn` before and after; see `verbs.Kernels`."""
    drawn, headings, cloud, about = arrays
    move(key, step, odometry, row, model[3], model[4][4] > 0.0, drawn, headings, cloud, about)
    store(cloud, drawn, headings)


@kernel
def update_step(key, step, log, t, model, tags, arrays, out, row):
    """`update` for particles that lie in `drawn`; see `verbs.Kernels`."""
    drawn, headings, cloud, _ = arrays
    load(drawn, headings, cloud)
    _steps(key, step, step + 1, t - step, False, log, model, tags, arrays, out, row - t - 1)


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """Run the filter over steps first..last-1 of a recording; estimates[t + 1] is the belief after step t.

    Parameters
    ----------
    log : as in `Recording.log`.
    model : (n_particles, positions (n, 2), whitening (n, 2, 2) float32, noise (3, 3), rules, table, ages, looks);
        ages: (is_age_compensated, delay of reads in steps); looks: (uses_rssi, learns from nothing seen, reader answers
        with all tags, slots (n,), phases (n,), period of its schedule, reach of the tables [mm], number of the table
        for tags not read).
    tags : as in `verbs.known`.
    arrays : (drawn, headings, cloud, about), see `_particle_kernels` and `_regularize_kernels`.
    """
    _steps(key, first, last, 0, True, log, model, tags, arrays, estimates, 0)


@kernel
def _steps(key, first, last, row_of_step, predicts, log, model, tags, arrays, estimates, row_of_row):
    """Steps first..last-1; step s has row s + `row_of_step` in the log, row t there t + 1 + `row_of_row` in estimates.

    Arrays are taken out of their tuples here, once: each time costs as much as a read.
    """
    drawn, headings, cloud, about = arrays
    n_particles, positions, whitening, noise, rules, table, (is_age_compensated, delay), looks = model
    uses_rssi, learns_from_nothing, is_inventory, slots, phases, period, reach, unread_table = looks
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    grid, ages = (per_cell, x0, y0, n_x, n_y), (is_age_compensated, delay)
    keeps_moments = rules[4] > 0.0
    # Beside the tables of the steps of RSSI there are that of any read and that of none.
    n_rssi = table.shape[0] - 2 if uses_rssi else 0
    reads = np.empty((room_for_evidence(log, first + row_of_step, last + row_of_step, model), N_READ), np.float32)
    for step in range(first, last):
        t = step + row_of_step
        if predicts:
            move(key, step, odometry, t, noise, keeps_moments, drawn, headings, cloud, about)
        gather(
            t, odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt, positions, whitening,
            is_age_compensated, delay, n_rssi, reads,
        )  # fmt: skip
        n_reads = n_evidence = read_start[t + 1] - read_start[t]
        if learns_from_nothing:
            n_evidence = gather_nothing_seen(
                step, t, odometry, read_start, read_antenna, read_tags, positions, whitening, slots, phases, period,
                ages, is_inventory, reach, unread_table, tag_x, tag_y, cell_start, grid, about, reads,
            )  # fmt: skip
        update(
            key, step, n_particles, reads, n_reads, n_evidence, rules, table, cloud, drawn, headings, about, estimates,
            t + 1 + row_of_row,
        )  # fmt: skip
