/* FMI 2.0 for co-simulation (Modelica Association, FMI specification 2.0.4).
 *
 * Linked together with others, its functions begin with FMI2_FUNCTION_PREFIX. */
#include <stddef.h>
#include "component.h"

#ifdef FMI2_FUNCTION_PREFIX
#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define FMI2(name) JOINED(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum {
    fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated
} fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String,
                                   fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    memory now;
    char name[200];
    const fmi2CallbackFunctions *callbacks;
    int logging;
} component;

static fmi2Status say(component *c, fmi2Status status, const char *what) {
    if (c->callbacks && c->callbacks->logger && (c->logging || status >= fmi2Error))
        c->callbacks->logger(c->callbacks->componentEnvironment, c->name, status,
                             status == fmi2Warning ? "logStatusWarning" : "logStatusError", "%s",
                             what);
    return status;
}

EXPORT const char *FMI2(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *FMI2(fmi2GetVersion)(void) { return "2.0"; }

EXPORT fmi2Status FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count,
                                            const fmi2String categories[]) {
    (void)count;
    (void)categories;
    ((component *)c)->logging = on;
    return fmi2OK;
}

EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                           fmi2String resources,
                                           const fmi2CallbackFunctions *callbacks,
                                           fmi2Boolean visible, fmi2Boolean logging) {
    component *c = (component *)calloc(1, sizeof *c);
    (void)resources;
    (void)visible;
    if (c == NULL) return NULL;
    snprintf(c->name, sizeof c->name, "%s", name ? name : "");
    c->callbacks = callbacks;
    c->logging = logging;
    memory_reset(&c->now);
    if (type != fmi2CoSimulation || guid == NULL || strcmp(guid, "@GUID@") != 0) {
        say(c, fmi2Error, type != fmi2CoSimulation ? "this FMU is for co-simulation"
                                                   : "the GUID is another model's");
        free(c);
        return NULL;
    }
#ifdef GIVEN
    {
        char said[200];
        c->now.parameters.given = given_open(resources, said);
        if (c->now.parameters.given == NULL) {
            say(c, fmi2Error, said);
            free(c);
            return NULL;
        }
    }
#endif
    return c;
}

EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c) {
#ifdef GIVEN
    if (c) given_close(((component *)c)->now.parameters.given);
#endif
    free(c);
}

EXPORT fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean toleranceDefined,
                                            fmi2Real tolerance, fmi2Real start,
                                            fmi2Boolean stopDefined, fmi2Real stop) {
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopDefined;
    (void)stop;
    ((component *)c)->now.origin = ((component *)c)->now.time = start;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c) {
    ((component *)c)->now.phase = INITIALISING;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c) {
    memory_start(&((component *)c)->now);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2Terminate)(fmi2Component c) {
    ((component *)c)->now.phase = ENDED;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2Reset)(fmi2Component c) {
    memory_reset(&((component *)c)->now);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                    fmi2Real values[]) {
    size_t i;
    for (i = 0; i < count; ++i) {
        const char *why = memory_get(&((component *)c)->now, which[i], values + i);
        if (why) return say((component *)c, fmi2Error, why);
    }
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference which[], size_t count,
                                    const fmi2Real values[]) {
    size_t i;
    for (i = 0; i < count; ++i) {
        const char *why = memory_set(&((component *)c)->now, which[i], values[i]);
        if (why) return say((component *)c, fmi2Error, why);
    }
    return fmi2OK;
}

/* Booleans: 0 whether orders are recorded positions, 1 whether it has diverged. */
EXPORT fmi2Status FMI2(fmi2GetBoolean)(fmi2Component c, const fmi2ValueReference which[],
                                       size_t count, fmi2Boolean values[]) {
    const memory *m = &((component *)c)->now;
    size_t i;
    for (i = 0; i < count; ++i) {
        if (which[i] > 1) return say((component *)c, fmi2Error, "there is no such boolean");
        values[i] = which[i] == 0 ? m->parameters.recorded : m->ship.diverged;
    }
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetBoolean)(fmi2Component c, const fmi2ValueReference which[],
                                       size_t count, const fmi2Boolean values[]) {
    memory *m = &((component *)c)->now;
    size_t i;
    for (i = 0; i < count; ++i) {
        if (which[i] != 0 || m->phase > INITIALISING)
            return say((component *)c, fmi2Error, "this boolean cannot be set now");
        m->parameters.recorded = values[i] != 0;
    }
    return fmi2OK;
}

#define NONE(name, type, constant)                                                              \
    EXPORT fmi2Status FMI2(name)(fmi2Component c, const fmi2ValueReference which[], size_t count, \
                                 constant type values[]) {                                      \
        (void)which;                                                                            \
        (void)values;                                                                           \
        return count == 0 ? fmi2OK : say((component *)c, fmi2Error, "it has no such variables"); \
    }
NONE(fmi2GetInteger, fmi2Integer, )
NONE(fmi2SetInteger, fmi2Integer, const)
NONE(fmi2GetString, fmi2String, )
NONE(fmi2SetString, fmi2String, const)

EXPORT fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    if (!memory_kept(state, &((component *)c)->now))
        return say((component *)c, fmi2Error, "no memory is left");
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
    memory_copy(&((component *)c)->now, (const memory *)state);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state,
                                                   size_t *size) {
    (void)c;
    (void)state;
    *size = sizeof(memory);
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                              size_t size) {
    if (size < sizeof(memory)) return say((component *)c, fmi2Error, "too few bytes");
    memcpy(bytes, state, sizeof(memory));
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[],
                                                size_t size, fmi2FMUstate *state) {
    if (size != sizeof(memory)) return say((component *)c, fmi2Error, "no state of this FMU");
    return memory_kept(state, bytes) ? fmi2OK : say((component *)c, fmi2Error, "no memory is left");
}

EXPORT fmi2Status FMI2(fmi2GetDirectionalDerivative)(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
    const fmi2ValueReference known[], size_t knowns, const fmi2Real by[], fmi2Real found[]) {
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)by;
    (void)found;
    return say((component *)c, fmi2Error, "it gives no directional derivatives");
}

EXPORT fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c,
                                                    const fmi2ValueReference which[], size_t count,
                                                    const fmi2Integer order[],
                                                    const fmi2Real values[]) {
    (void)which;
    (void)count;
    (void)order;
    (void)values;
    return say((component *)c, fmi2Error, "inputs are held over a step");
}

EXPORT fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c,
                                                     const fmi2ValueReference which[],
                                                     size_t count, const fmi2Integer order[],
                                                     fmi2Real values[]) {
    (void)which;
    (void)count;
    (void)order;
    (void)values;
    return say((component *)c, fmi2Error, "it gives no derivatives of its outputs");
}

EXPORT fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real at, fmi2Real seconds,
                                   fmi2Boolean noSetPrior) {
    char said[200];
    component *own = (component *)c;
    int how;
    (void)noSetPrior;
    if (own->now.phase != STEPPING) return say(own, fmi2Error, "it was not initialised");
    how = memory_step(&own->now, at, seconds, said);
    return how == DONE ? fmi2OK : say(own, how == WARNED ? fmi2Warning : fmi2Error, said);
}

EXPORT fmi2Status FMI2(fmi2CancelStep)(fmi2Component c) {
    return say((component *)c, fmi2Error, "a step is done when fmi2DoStep returns");
}

EXPORT fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
    (void)c;
    (void)kind;
    *value = fmi2OK;
    return fmi2Discard;
}

EXPORT fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((component *)c)->now.time;
    return fmi2OK;
}

EXPORT fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, fmi2StatusKind kind,
                                             fmi2Integer *value) {
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

EXPORT fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, fmi2StatusKind kind,
                                             fmi2Boolean *value) {
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

EXPORT fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, fmi2StatusKind kind,
                                            fmi2String *value) {
    (void)c;
    (void)kind;
    *value = "";
    return fmi2Discard;
}
