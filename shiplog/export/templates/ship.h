/* @SHIP@: the run @RUN@ (@LABEL@), written by @AUTHOR@.
 *
 * nu' = f(x, u, w) with x over ground; u the actuators, held over a step; w the true wind.
 * Velocities by @METHOD@ at the step that `shiplog simulate` sails it with, place and heading by
 * the trapezoidal rule. SI: m, m/s, rad, rad/s; actuators in @UNITS@.
 * Earth axes x0, y0; body axes x ahead, y to starboard; heading from x0 towards y0; midship.
@RECORD@
 */
#ifndef @NAME@_H
#define @NAME@_H

#include <math.h>
#include <string.h>

#define @NAME@_COEFFICIENTS @COEFFICIENTS@
#define @NAME@_CONSTANTS @CONSTANTS@
#define @NAME@_ACTUATORS @ACTUATORS@
#define @NAME@_PAST @PAST@ /* steps that the steering's delay looks back; at least 1 */
#define @NAME@_STEP @STEP@ /* s */
#ifdef GIVEN
#include "given.h"
#endif

/* What drives it, held over a step.
 * order    [actuators] ordered positions; they are followed at `rate` unless `recorded`
 * wind     where it comes from over ground, along x0 and y0
 * current  where it sets, along x0 and y0 */
typedef struct {
    double order[@NAME@_ACTUATORS];
    double wind[2];
    double current[2];
} @NAME@_input;

typedef struct {
    double coefficient[@NAME@_COEFFICIENTS + 1];
    double rate[@NAME@_ACTUATORS]; /* the fastest change a second */
    int recorded; /* orders are recorded positions: no rate limits them */
#ifdef GIVEN
    struct given *given; /* the simulator that is asked */
#endif
} @NAME@_parameters;

/* state      x0, surge, y0, sway, heading, yaw rate, over ground, at the last step's end
 * turn       cosine and sine of its heading
 * actuator   positions there, as recorded
 * past       what was recorded before, for the steering's delay; lagged: its lag's state
 * begun      whether the next step's accelerations are known: its inputs were taken */
typedef struct {
    double constant[@NAME@_CONSTANTS + 1];
    double state[6];
    double turn[2];
    double actuator[@NAME@_ACTUATORS];
    double acceleration[3];
    double lagged[@NAME@_ACTUATORS];
    double past[@NAME@_PAST * @NAME@_ACTUATORS];
    @NAME@_input held;
    int remembered;
    int begun;
    int sailed;
    int diverged;
} @NAME@_ship;

/* Places of the coefficients, for those who change one. */
enum {
@PLACES@
};

@ARRAYS@

static double @NAME@_larger(double a, double b) { return a > b || a != a ? a : b; }
static double @NAME@_smaller(double a, double b) { return a < b || a != a ? a : b; }
@MATRICES@
/* What depends on the coefficients alone. */
static void @NAME@_prepare(const double *p, double *c) {
@HOISTED@
    (void)p;
    (void)c;
    (void)@NAME@_larger;
    (void)@NAME@_smaller;
}

/* Accelerations [3] of x: x0, surge, y0, sway, heading, yaw rate, the actuators, and the true wind
 * along x0 and y0, all relative to the water; turn: cosine and sine of the heading. */
static void @NAME@_accelerations(const double *c, const double *x, const double *turn,
                                 double *acceleration@GIVEN_PARAMETER@) {
@VARYING@
    acceleration[0] = @SURGE@;
    acceleration[1] = @SWAY@;
    acceleration[2] = @YAW@;
#ifdef GIVEN
    {
        const double water[2] = {@WATER@};
        given_accelerations(given, x, turn, water, acceleration);
    }
#endif
    (void)c;
    (void)turn;
}

/* Velocities over ground (sign = 1) or through the water (-1) of the other ones. */
static void @NAME@_across(double *state, const double *turn, const double *current, double sign) {
    const double c = turn[0], s = turn[1];
    state[1] += sign * (c * current[0] + s * current[1]);
    state[3] += sign * (c * current[1] - s * current[0]);
}

/* A state through the water a step on: velocities by Euler, place and heading by the trapezoidal
 * rule; the water moves over ground. */
static void @NAME@_advance(const double *state, const double *turn, const double *rate,
                           const double *current, double step, double *next, double *next_turn) {
    double c = turn[0], s = turn[1], north, east;
    next[1] = state[1] + step * rate[0];
    next[3] = state[3] + step * rate[1];
    next[5] = state[5] + step * rate[2];
    next[4] = state[4] + 0.5 * step * (state[5] + next[5]);
    north = c * state[1] - s * state[3];
    east = s * state[1] + c * state[3];
    c = next_turn[0] = cos(next[4]);
    s = next_turn[1] = sin(next[4]);
    north += c * next[1] - s * next[3];
    east += s * next[1] + c * next[3];
    next[0] = state[0] + step * (0.5 * north + current[0]);
    next[2] = state[2] + step * (0.5 * east + current[1]);
}

/* Actuators `seconds` later on their way to an order, and their mean over that time. */
static void @NAME@_move(const @NAME@_parameters *p, const double *now, const double *order,
                        double seconds, double *end, double *mean) {
    int i;
    for (i = 0; i < @NAME@_ACTUATORS; ++i) {
        const double way = order[i] - now[i], rate = p->rate[i];
        const double moving = fabs(way) / rate < seconds ? fabs(way) / rate : seconds;
        if (p->recorded || way == 0.0) {
            end[i] = mean[i] = order[i];
            continue;
        }
        end[i] = fabs(way) <= rate * seconds ? order[i] : now[i] + copysign(rate * moving, way);
        mean[i] = (0.5 * (now[i] + end[i]) * moving + end[i] * (seconds - moving)) / seconds;
    }
}

/* Actuators as they act, of what is recorded of them: offset, delay and lag of the steering. */
static void @NAME@_act(@NAME@_ship *ship, const double *recorded, double *acting) {
    const int delayed = @DELAYED@, lagging = @LAGGING@;
    int i;
    if (delayed) {
        const int keep = @NAME@_PAST;
        if (ship->remembered == keep) {
            memmove(ship->past, ship->past + @NAME@_ACTUATORS,
                    (size_t)(keep - 1) * @NAME@_ACTUATORS * sizeof(double));
            ship->remembered = keep - 1;
        }
        memcpy(ship->past + ship->remembered * @NAME@_ACTUATORS, recorded,
               @NAME@_ACTUATORS * sizeof(double));
        ship->remembered += 1;
    }
    for (i = 0; i < @NAME@_ACTUATORS; ++i) {
        double found = recorded[i];
        if (delayed) {
            const int last = ship->remembered - 1 - @WHOLE@;
            const int late = last > 0 ? last : 0, later = last > 1 ? last - 1 : 0;
            const double one = ship->past[late * @NAME@_ACTUATORS + i];
            const double other = ship->past[later * @NAME@_ACTUATORS + i];
            found = one + @PART@ * (other - one);
        }
        if (lagging) {
            if (!ship->sailed) ship->lagged[i] = found;
            ship->lagged[i] += @SHARE@ * (found - ship->lagged[i]);
            found = ship->lagged[i];
        }
        acting[i] = @NAME@_STEERS[i] ? found + @NAME@_OFFSET[i] : recorded[i];
    }
}

static void @NAME@_defaults(@NAME@_parameters *p) {
    memcpy(p->coefficient, @NAME@_COEFFICIENT, sizeof(double) * @NAME@_COEFFICIENTS);
    memcpy(p->rate, @NAME@_RATE, sizeof(double) * @NAME@_ACTUATORS);
    p->recorded = 0;
}

/* At a state [6] over ground, with its actuators at these positions (NULL: as on the approach). */
static void @NAME@_begin(@NAME@_ship *ship, const @NAME@_parameters *p, const double *state,
                         const double *actuator) {
    memset(ship, 0, sizeof *ship);
    @NAME@_prepare(p->coefficient, ship->constant);
    memcpy(ship->state, state, 6 * sizeof(double));
    ship->turn[0] = cos(state[4]);
    ship->turn[1] = sin(state[4]);
    memcpy(ship->actuator, actuator ? actuator : @NAME@_APPROACH, sizeof ship->actuator);
}

/* The next step's accelerations: its inputs are taken now, and held until its end. */
static void @NAME@_take(@NAME@_ship *ship, const @NAME@_parameters *p, const @NAME@_input *input) {
    double x[6 + @NAME@_ACTUATORS + 2], end[@NAME@_ACTUATORS], mean[@NAME@_ACTUATORS];
    const double *current = input->current;
    if (ship->begun) return;
    ship->held = *input;
    memcpy(x, ship->state, 6 * sizeof(double));
    @NAME@_across(x, ship->turn, current, -1.0);
    @NAME@_move(p, ship->actuator, input->order, @NAME@_STEP, end, mean);
    @NAME@_act(ship, mean, x + 6);
    x[6 + @NAME@_ACTUATORS] = input->wind[0] + current[0];
    x[7 + @NAME@_ACTUATORS] = input->wind[1] + current[1];
    @NAME@_accelerations(ship->constant, x, ship->turn, ship->acceleration@GIVEN_ARGUMENT@);
    if (@HEUN@) { /* of coefficients that were not fitted to Euler's steps */
        double ahead[6 + @NAME@_ACTUATORS + 2], turn[2], second[3];
        int i;
        memcpy(ahead, x, sizeof x);
        @NAME@_advance(x, ship->turn, ship->acceleration, current, @NAME@_STEP, ahead, turn);
        @NAME@_accelerations(ship->constant, ahead, turn, second@GIVEN_ARGUMENT@);
        for (i = 0; i < 3; ++i) ship->acceleration[i] = 0.5 * (ship->acceleration[i] + second[i]);
    }
    ship->begun = ship->sailed = 1;
}

/* State [6] over ground, its turn and actuators, `seconds` into a step that was begun. */
static void @NAME@_within(const @NAME@_ship *ship, const @NAME@_parameters *p, double seconds,
                          double *state, double *turn, double *actuator) {
    double now[6], mean[@NAME@_ACTUATORS];
    memcpy(now, ship->state, sizeof now);
    @NAME@_across(now, ship->turn, ship->held.current, -1.0);
    @NAME@_advance(now, ship->turn, ship->acceleration, ship->held.current, seconds, state, turn);
    @NAME@_across(state, turn, ship->held.current, 1.0);
    @NAME@_move(p, ship->actuator, ship->held.order, seconds, actuator, mean);
}

/* A whole step of @NAME@_STEP seconds. 0, or 1 where it has diverged: no ship goes there. */
static int @NAME@_step(@NAME@_ship *ship, const @NAME@_parameters *p, const @NAME@_input *input) {
    double state[6], turn[2], actuator[@NAME@_ACTUATORS];
    @NAME@_take(ship, p, input);
    @NAME@_within(ship, p, @NAME@_STEP, state, turn, actuator);
    memcpy(ship->turn, turn, sizeof turn);
    memcpy(ship->state, state, sizeof state);
    memcpy(ship->actuator, actuator, sizeof actuator);
    ship->begun = 0;
    if (!(fabs(state[1]) < @LIMIT_SURGE@ && fabs(state[3]) < @LIMIT_SWAY@ &&
          fabs(state[5]) < @LIMIT_YAW@))
        ship->diverged = 1;
    return ship->diverged;
}

#endif
