/* A ship between communication points, the same for FMI 2.0 and 3.0.
 *
 * Inner steps of @NAME@_STEP seconds begin at whole multiples of it after the start, whatever the
 * communication step. A step takes its inputs at the communication point at or before its begin, and
 * holds them. Between two inner steps outputs are those of the step that was begun. */
#include <stdio.h>
#include <stdlib.h>
#include "ship.h"

#define ROUNDED (1e-6 * @NAME@_STEP) /* s by which sums of communication steps may be off */

/* Value references of the real variables */
enum {
    V_ORDER = 0,
    V_WIND = V_ORDER + @NAME@_ACTUATORS,
    V_CURRENT = V_WIND + 2,
    V_STATE = V_CURRENT + 2,
    V_ACTUATOR = V_STATE + 6,
    V_ACCELERATION = V_ACTUATOR + @NAME@_ACTUATORS,
    V_START = V_ACCELERATION + 3,
    V_START_ACTUATOR = V_START + 6,
    V_RATE = V_START_ACTUATOR + @NAME@_ACTUATORS,
    V_COEFFICIENT = V_RATE + @NAME@_ACTUATORS,
    V_END = V_COEFFICIENT + @NAME@_COEFFICIENTS
};

enum { MADE, INITIALISING, STEPPING, ENDED };
enum { DONE, WARNED, FAILED };

/* All of a ship's memory: to copy it is to keep its state. */
typedef struct {
    @NAME@_ship ship;
    @NAME@_parameters parameters;
    @NAME@_input input;
    double start[6];
    double start_actuator[@NAME@_ACTUATORS];
    double state[6];
    double actuator[@NAME@_ACTUATORS];
    double origin;
    double time;
    double steps;
    int phase;
    int changed;
} memory;

/* All but what belongs to the instance. */
static void memory_copy(memory *to, const memory *from) {
#ifdef GIVEN
    struct given *own = to->parameters.given;
#endif
    memcpy(to, from, sizeof *to);
#ifdef GIVEN
    to->parameters.given = own;
#endif
}

/* A state that an importer keeps, in memory that is taken where there is none. 0 where none is left. */
static int memory_kept(void **to, const void *from) {
    if (*to == NULL) *to = malloc(sizeof(memory));
    if (*to != NULL) memcpy(*to, from, sizeof(memory));
    return *to != NULL;
}

static void memory_reset(memory *m) {
    static const memory nothing;
    memory_copy(m, &nothing);
    @NAME@_defaults(&m->parameters);
    memcpy(m->input.order, @NAME@_APPROACH, sizeof m->input.order);
    memcpy(m->start_actuator, @NAME@_APPROACH, sizeof m->start_actuator);
    m->start[1] = @SPEED@;
    memcpy(m->state, m->start, sizeof m->state);
    memcpy(m->actuator, m->start_actuator, sizeof m->actuator);
    m->phase = MADE;
}

/* Where a variable is; NULL for none. `open`: whether it may be set in this phase. */
static double *memory_real(memory *m, unsigned place, int *open) {
    *open = 1;
    if (place < V_WIND) return m->input.order + (place - V_ORDER);
    if (place < V_CURRENT) return m->input.wind + (place - V_WIND);
    if (place < V_STATE) return m->input.current + (place - V_CURRENT);
    *open = 0;
    if (place < V_ACTUATOR) return m->state + (place - V_STATE);
    if (place < V_ACCELERATION) return m->actuator + (place - V_ACTUATOR);
    if (place < V_START) return m->ship.acceleration + (place - V_ACCELERATION);
    *open = m->phase <= INITIALISING;
    if (place < V_START_ACTUATOR) return m->start + (place - V_START);
    if (place < V_RATE) return m->start_actuator + (place - V_START_ACTUATOR);
    *open = 1;
    if (place < V_COEFFICIENT) return m->parameters.rate + (place - V_RATE);
    if (place < V_END) return m->parameters.coefficient + (place - V_COEFFICIENT);
    return NULL;
}

static const char *memory_get(memory *m, unsigned place, double *value) {
    int open;
    const double *from = memory_real(m, place, &open);
    if (from == NULL) return "there is no variable with this value reference";
    if (m->phase <= INITIALISING && place >= V_STATE && place < V_ACTUATOR)
        from = m->start + (place - V_STATE); /* it is where it will begin */
    if (m->phase <= INITIALISING && place >= V_ACTUATOR && place < V_ACCELERATION)
        from = m->start_actuator + (place - V_ACTUATOR);
    *value = *from;
    return NULL;
}

static const char *memory_set(memory *m, unsigned place, double value) {
    int open;
    double *to = memory_real(m, place, &open);
    if (to == NULL) return "there is no variable with this value reference";
    if (!open) return "this variable cannot be set now";
    if (!(fabs(value) < HUGE_VAL)) return "a value is not finite";
    if (place >= V_RATE && place < V_COEFFICIENT && value <= 0.0) return "a rate is not positive";
    *to = value;
    if (place >= V_COEFFICIENT) m->changed = 1;
    return NULL;
}

static void memory_start(memory *m) {
    @NAME@_begin(&m->ship, &m->parameters, m->start, m->start_actuator);
    memcpy(m->state, m->start, sizeof m->state);
    memcpy(m->actuator, m->start_actuator, sizeof m->actuator);
    m->time = m->origin;
    m->steps = 0.0;
    m->changed = 0;
    m->phase = STEPPING;
}

/* From one communication point to the next. `said` [200]: what is to be known of it. */
static int memory_step(memory *m, double at, double seconds, char *said) {
    double end = at + seconds, turn[2], begun;
    const int before = m->ship.diverged;
    int i;
    said[0] = 0;
    if (!(fabs(at - m->time) <= ROUNDED + 1e-9 * fabs(at))) {
        snprintf(said, 200, "the step begins at %.9g s, and the last one ended at %.9g s", at, m->time);
        return FAILED;
    }
    if (!(seconds >= 0.0 && seconds < HUGE_VAL)) {
        snprintf(said, 200, "a communication step of %.9g s", seconds);
        return FAILED;
    }
    if (m->changed) @NAME@_prepare(m->parameters.coefficient, m->ship.constant);
    m->changed = 0;
    while (m->origin + (m->steps + 1.0) * @NAME@_STEP <= end + ROUNDED) {
        @NAME@_step(&m->ship, &m->parameters, &m->input);
        m->steps += 1.0;
    }
    begun = end - (m->origin + m->steps * @NAME@_STEP);
    if (begun > ROUNDED) {
        @NAME@_take(&m->ship, &m->parameters, &m->input);
        @NAME@_within(&m->ship, &m->parameters, begun, m->state, turn, m->actuator);
    } else {
        memcpy(m->state, m->ship.state, sizeof m->state);
        memcpy(m->actuator, m->ship.actuator, sizeof m->actuator);
    }
    m->time = end;
    for (i = 0; i < 6; ++i)
        if (!(fabs(m->state[i]) < HUGE_VAL)) {
#ifdef GIVEN
            if (m->parameters.given->said[0]) {
                snprintf(said, 200, "before %.9g s %.150s", end, m->parameters.given->said);
                return FAILED;
            }
#endif
            snprintf(said, 200, "the model has no finite state at %.9g s", end);
            return FAILED;
        }
    if (m->ship.diverged && !before) {
        snprintf(said, 200, "at %.9g s the model is where no ship goes: it has diverged", end);
        return WARNED;
    }
    return DONE;
}
