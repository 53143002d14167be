/* FMI 3.0 for co-simulation (Modelica Association, FMI specification 3.0.2).
 *
 * The functions of the other kinds are there, as the standard asks, and answer fmi3Error. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "component.h"

#ifdef FMI3_FUNCTION_PREFIX
#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define FMI3(name) JOINED(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3(name) name
#endif
#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi3Instance;
typedef void *fmi3Environment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3Log)(fmi3Environment, fmi3Status, fmi3String, fmi3String);

enum { V_TIME = V_END, V_RECORDED, V_DIVERGED };

typedef struct {
    memory now;
    fmi3Environment environment;
    fmi3Log log;
    int logging;
} component;

static fmi3Status say(fmi3Instance c, fmi3Status status, const char *what) {
    component *own = (component *)c;
    if (own && own->log && (own->logging || status >= fmi3Error))
        own->log(own->environment, status,
                 status == fmi3Warning ? "logStatusWarning" : "logStatusError", what);
    return status;
}

EXPORT const char *FMI3(fmi3GetVersion)(void) { return "3.0"; }

EXPORT fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance c, fmi3Boolean on, size_t count,
                                            const fmi3String categories[]) {
    (void)count;
    (void)categories;
    ((component *)c)->logging = on;
    return fmi3OK;
}

EXPORT fmi3Instance FMI3(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean eventMode, fmi3Boolean earlyReturn,
    const fmi3ValueReference required[], size_t count, fmi3Environment environment, fmi3Log log,
    void (*intermediate)(void)) {
    component *c = (component *)calloc(1, sizeof *c);
    (void)name;
    (void)resources;
    (void)visible;
    (void)eventMode;
    (void)earlyReturn;
    (void)required;
    (void)count;
    (void)intermediate;
    if (c == NULL) return NULL;
    c->environment = environment;
    c->log = log;
    c->logging = logging;
    memory_reset(&c->now);
    if (token == NULL || strcmp(token, "@GUID@") != 0) {
        say(c, fmi3Error, "the instantiation token is another model's");
        free(c);
        return NULL;
    }
#ifdef GIVEN
    {
        char said[200];
        c->now.parameters.given = given_open(resources, said);
        if (c->now.parameters.given == NULL) {
            say(c, fmi3Error, said);
            free(c);
            return NULL;
        }
    }
#endif
    return c;
}

EXPORT fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token,
                                                       fmi3String resources, fmi3Boolean visible,
                                                       fmi3Boolean logging,
                                                       fmi3Environment environment, fmi3Log log) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    return NULL;
}

EXPORT fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Environment environment, fmi3Log log, void (*update)(void),
    void (*lock)(void), void (*unlock)(void)) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    (void)update;
    (void)lock;
    (void)unlock;
    return NULL;
}

EXPORT void FMI3(fmi3FreeInstance)(fmi3Instance c) {
#ifdef GIVEN
    if (c) given_close(((component *)c)->now.parameters.given);
#endif
    free(c);
}

EXPORT fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance c, fmi3Boolean toleranceDefined,
                                                    fmi3Float64 tolerance, fmi3Float64 start,
                                                    fmi3Boolean stopDefined, fmi3Float64 stop) {
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopDefined;
    (void)stop;
    ((component *)c)->now.origin = ((component *)c)->now.time = start;
    ((component *)c)->now.phase = INITIALISING;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance c) {
    memory_start(&((component *)c)->now);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3Terminate)(fmi3Instance c) {
    ((component *)c)->now.phase = ENDED;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3Reset)(fmi3Instance c) {
    memory_reset(&((component *)c)->now);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance c, const fmi3ValueReference which[],
                                       size_t count, fmi3Float64 values[], size_t values_count) {
    memory *m = &((component *)c)->now;
    size_t i;
    if (values_count != count) return say(c, fmi3Error, "each of its variables has one value");
    for (i = 0; i < count; ++i) {
        const char *why = NULL;
        if (which[i] == V_TIME)
            values[i] = m->time;
        else
            why = memory_get(m, which[i], values + i);
        if (why) return say(c, fmi3Error, why);
    }
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance c, const fmi3ValueReference which[],
                                       size_t count, const fmi3Float64 values[],
                                       size_t values_count) {
    size_t i;
    if (values_count != count) return say(c, fmi3Error, "each of its variables has one value");
    for (i = 0; i < count; ++i) {
        const char *why = memory_set(&((component *)c)->now, which[i], values[i]);
        if (why) return say(c, fmi3Error, why);
    }
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3GetBoolean)(fmi3Instance c, const fmi3ValueReference which[],
                                       size_t count, fmi3Boolean values[], size_t values_count) {
    const memory *m = &((component *)c)->now;
    size_t i;
    if (values_count != count) return say(c, fmi3Error, "each of its variables has one value");
    for (i = 0; i < count; ++i) {
        if (which[i] != V_RECORDED && which[i] != V_DIVERGED)
            return say(c, fmi3Error, "there is no such boolean");
        values[i] = which[i] == V_RECORDED ? m->parameters.recorded : m->ship.diverged;
    }
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetBoolean)(fmi3Instance c, const fmi3ValueReference which[],
                                       size_t count, const fmi3Boolean values[],
                                       size_t values_count) {
    memory *m = &((component *)c)->now;
    size_t i;
    if (values_count != count) return say(c, fmi3Error, "each of its variables has one value");
    for (i = 0; i < count; ++i) {
        if (which[i] != V_RECORDED || m->phase > INITIALISING)
            return say(c, fmi3Error, "this boolean cannot be set now");
        m->parameters.recorded = values[i];
    }
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance c, fmi3FMUState *state) {
    if (!memory_kept(state, &((component *)c)->now))
        return say(c, fmi3Error, "no memory is left");
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance c, fmi3FMUState state) {
    memory_copy(&((component *)c)->now, (const memory *)state);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state,
                                                   size_t *size) {
    (void)c;
    (void)state;
    *size = sizeof(memory);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[],
                                              size_t size) {
    if (size < sizeof(memory)) return say(c, fmi3Error, "too few bytes");
    memcpy(bytes, state, sizeof(memory));
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                                fmi3FMUState *state) {
    if (size != sizeof(memory)) return say(c, fmi3Error, "no state of this FMU");
    return memory_kept(state, bytes) ? fmi3OK : say(c, fmi3Error, "no memory is left");
}

EXPORT fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance c) {
    return say(c, fmi3Error, "it has no event mode");
}

EXPORT fmi3Status FMI3(fmi3DoStep)(fmi3Instance c, fmi3Float64 at, fmi3Float64 seconds,
                                   fmi3Boolean noSetPrior, fmi3Boolean *event,
                                   fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    char said[200];
    component *own = (component *)c;
    int how;
    (void)noSetPrior;
    *event = *terminate = *early = false;
    *last = own->now.time;
    if (own->now.phase != STEPPING) return say(own, fmi3Error, "it was not initialised");
    how = memory_step(&own->now, at, seconds, said);
    if (how != FAILED) *last = own->now.time;
    return how == DONE ? fmi3OK : say(own, how == WARNED ? fmi3Warning : fmi3Error, said);
}

/* Types that it has no variables of */
#define NONE(name, type)                                                                         \
    EXPORT fmi3Status FMI3(fmi3Get##name)(fmi3Instance c, const fmi3ValueReference which[],      \
                                          size_t count, type values[], size_t values_count) {    \
        (void)which;                                                                             \
        (void)values;                                                                            \
        (void)values_count;                                                                      \
        return count == 0 ? fmi3OK : say(c, fmi3Error, "it has no such variables");              \
    }                                                                                            \
    EXPORT fmi3Status FMI3(fmi3Set##name)(fmi3Instance c, const fmi3ValueReference which[],      \
                                          size_t count, const type values[],                     \
                                          size_t values_count) {                                 \
        (void)which;                                                                             \
        (void)values;                                                                            \
        (void)values_count;                                                                      \
        return count == 0 ? fmi3OK : say(c, fmi3Error, "it has no such variables");              \
    }
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(String, fmi3String)

/* What an FMU for co-simulation without events, clocks and derivatives does not do */
#define REFUSED(name, ...)                                               \
    EXPORT fmi3Status FMI3(name)(fmi3Instance c, __VA_ARGS__) {          \
        return say(c, fmi3Error, #name " is not supported by this FMU"); \
    }
#define REFUSED_PLAIN(name)                                              \
    EXPORT fmi3Status FMI3(name)(fmi3Instance c) {                       \
        return say(c, fmi3Error, #name " is not supported by this FMU"); \
    }
typedef const fmi3ValueReference *which_;
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
REFUSED(fmi3GetBinary, which_ w, size_t n, size_t s[], fmi3Binary v[], size_t k)
REFUSED(fmi3SetBinary, which_ w, size_t n, const size_t s[], const fmi3Binary v[], size_t k)
REFUSED(fmi3GetClock, which_ w, size_t n, bool v[])
REFUSED(fmi3SetClock, which_ w, size_t n, const bool v[])
REFUSED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference w, size_t *n)
REFUSED(fmi3GetVariableDependencies, fmi3ValueReference w, size_t a[], fmi3ValueReference b[],
        size_t d[], int k[], size_t n)
REFUSED(fmi3GetDirectionalDerivative, which_ u, size_t nu, which_ k, size_t nk, const double s[],
        size_t ns, double f[], size_t nf)
REFUSED(fmi3GetAdjointDerivative, which_ u, size_t nu, which_ k, size_t nk, const double s[],
        size_t ns, double f[], size_t nf)
REFUSED_PLAIN(fmi3EnterConfigurationMode)
REFUSED_PLAIN(fmi3ExitConfigurationMode)
REFUSED_PLAIN(fmi3EnterEventMode)
REFUSED_PLAIN(fmi3EvaluateDiscreteStates)
REFUSED_PLAIN(fmi3EnterContinuousTimeMode)
REFUSED(fmi3GetIntervalDecimal, which_ w, size_t n, double v[], int q[])
REFUSED(fmi3GetIntervalFraction, which_ w, size_t n, uint64_t a[], uint64_t b[], int q[])
REFUSED(fmi3GetShiftDecimal, which_ w, size_t n, double v[])
REFUSED(fmi3GetShiftFraction, which_ w, size_t n, uint64_t a[], uint64_t b[])
REFUSED(fmi3SetIntervalDecimal, which_ w, size_t n, const double v[])
REFUSED(fmi3SetIntervalFraction, which_ w, size_t n, const uint64_t a[], const uint64_t b[])
REFUSED(fmi3SetShiftDecimal, which_ w, size_t n, const double v[])
REFUSED(fmi3SetShiftFraction, which_ w, size_t n, const uint64_t a[], const uint64_t b[])
REFUSED(fmi3UpdateDiscreteStates, bool *a, bool *b, bool *d, bool *e, bool *f, double *t)
REFUSED(fmi3CompletedIntegratorStep, bool p, bool *e, bool *t)
REFUSED(fmi3SetTime, double t)
REFUSED(fmi3SetContinuousStates, const double v[], size_t n)
REFUSED(fmi3GetContinuousStateDerivatives, double v[], size_t n)
REFUSED(fmi3GetEventIndicators, double v[], size_t n)
REFUSED(fmi3GetContinuousStates, double v[], size_t n)
REFUSED(fmi3GetNominalsOfContinuousStates, double v[], size_t n)
REFUSED(fmi3GetNumberOfEventIndicators, size_t *n)
REFUSED(fmi3GetNumberOfContinuousStates, size_t *n)
REFUSED(fmi3GetOutputDerivatives, which_ w, size_t n, const int32_t o[], double v[], size_t k)
REFUSED(fmi3ActivateModelPartition, fmi3ValueReference w, double t)
