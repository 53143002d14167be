/* The given FMU @FILE@, which this one has in resources/given
 * (SHA-256 @SHA256@).
 *
 * It is asked for accelerations at the ship's state, its actuators and the wind: it begins there
 * anew, takes two short steps h, and
 *
 *     nu' = (-3 nu(0) + 4 nu(h) - nu(2h)) / 2h
 *
 * or, for model exchange, gives its derivatives. So all that is kept of it is the ship's state. */
#ifndef GIVEN_H
#define GIVEN_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#define GIVEN_FMI @FMI@
#define GIVEN_EXCHANGE @EXCHANGE@
#define GIVEN_IDENTIFIER "@IDENTIFIER@"
#define GIVEN_TOKEN "@TOKEN@"
#define GIVEN_SHORT @SHORT@ /* s */
#define GIVEN_LONGEST 4096 /* letters of a path */
#define GIVEN_MOST_EVENTS 100 /* iterations at a start, beyond which it never settles */

#if defined(_WIN32)
#define GIVEN_SYSTEM "windows"
#define GIVEN_SHORT_NAME "win64"
#define GIVEN_ENDING ".dll"
#elif defined(__APPLE__)
#define GIVEN_SYSTEM "darwin"
#define GIVEN_SHORT_NAME "darwin64"
#define GIVEN_ENDING ".dylib"
#else
#define GIVEN_SYSTEM "linux"
#define GIVEN_SHORT_NAME "linux64"
#define GIVEN_ENDING ".so"
#endif
#if defined(__aarch64__)
#define GIVEN_MACHINE "aarch64-"
#else
#define GIVEN_MACHINE "x86_64-"
#endif

enum { @COUNTS@, GIVEN_STATES = @STATES@ };

/* A channel of the ship in SI, the variable that has it, and what a value of that is multiplied by
 * for SI. Channels: the state, the actuators, apparent wind (speed, angle), where the true wind
 * comes from along x0 and y0, its speed and direction. */
typedef struct {
    int channel;
    unsigned variable;
    double factor;
} given_row;
typedef struct {
    int kind; /* 0 a real, 1 a boolean, 2 an integer */
    unsigned variable;
    double value;
} given_parameter;
static const given_row given_start[] = {@STARTS@};
static const given_row given_input[] = {@INPUTS@};
static const given_row given_velocity[] = {@OUTPUTS@};
static const given_row given_place[] = {@PLACES@}; /* of the ship's among its states */
static const int given_moving[] = {@MOVING@};
static const given_parameter given_set[] = {@PARAMETERS@};

typedef void *given_instance;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} given_callbacks;
typedef struct {
    int more, end, nominals, values, next;
    double time;
} given_events;

struct given {
    void *library;
    given_instance instance;
    given_callbacks callbacks;
    int begun, spoilt;
    char folder[GIVEN_LONGEST];    /* resources/given, a path */
    char resources[GIVEN_LONGEST]; /* its own, as its version wants it */
    char said[200];
    double first[GIVEN_STATES + 1], z[GIVEN_STATES + 1], f[GIVEN_STATES + 1];
    void (*free_instance)(given_instance);
    int (*reset)(given_instance);
    int (*leave)(given_instance);
#if GIVEN_FMI == 2
    given_instance (*instantiate)(const char *, int, const char *, const char *,
                                  const given_callbacks *, int, int);
    int (*set_up)(given_instance, int, double, double, int, double);
    int (*enter)(given_instance);
    int (*get)(given_instance, const unsigned *, size_t, double *);
    int (*put)(given_instance, const unsigned *, size_t, const double *);
    int (*put_boolean)(given_instance, const unsigned *, size_t, const int *);
    int (*put_integer)(given_instance, const unsigned *, size_t, const int *);
    int (*step)(given_instance, double, double, int);
    int (*new_states)(given_instance, given_events *);
    int (*go_on)(given_instance);
    int (*put_states)(given_instance, const double *, size_t);
    int (*get_states)(given_instance, double *, size_t);
    int (*derivatives)(given_instance, double *, size_t);
#else
    given_instance (*instantiate)(const char *, const char *, const char *, _Bool, _Bool, _Bool,
                                  _Bool, const unsigned *, size_t, void *, void *, void *);
    int (*enter)(given_instance, _Bool, double, double, _Bool, double);
    int (*get)(given_instance, const unsigned *, size_t, double *, size_t);
    int (*put)(given_instance, const unsigned *, size_t, const double *, size_t);
    int (*put_boolean)(given_instance, const unsigned *, size_t, const _Bool *, size_t);
    int (*put_integer)(given_instance, const unsigned *, size_t, const int *, size_t);
    int (*step)(given_instance, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);
#endif
};

static void given_no_log(void *a, const char *b, int c, const char *d, const char *e, ...) {
    (void)a, (void)b, (void)c, (void)d, (void)e;
}
#if GIVEN_FMI == 3
static void given_silent(void *a, int b, const char *c, const char *d) {
    (void)a, (void)b, (void)c, (void)d;
}
#endif

/* --- where it is ------------------------------------------------------------------------------ */

static int given_hex(char letter) {
    if (letter >= '0' && letter <= '9') return letter - '0';
    if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
    return letter >= 'A' && letter <= 'F' ? letter - 'A' + 10 : -1;
}

/* The path of a file: URI, or of a path, without what separates folders at its end. */
static int given_path(const char *resources, char *path) {
    const int coded = strncmp(resources, "file:", 5) == 0;
    size_t n = 0;
    if (coded) {
        resources += 5;
        if (strncmp(resources, "//", 2) == 0) {
            resources += 2;
            while (*resources && *resources != '/') ++resources; /* the host */
        }
#ifdef _WIN32
        if (*resources == '/' && resources[1] && (resources[2] == ':' || resources[2] == '|'))
            ++resources;
#endif
    }
    while (*resources && n + 1 < GIVEN_LONGEST) {
        const int coded_letter = coded && *resources == '%' && given_hex(resources[1]) >= 0 &&
                                 given_hex(resources[2]) >= 0;
        path[n++] = coded_letter ? (char)(16 * given_hex(resources[1]) + given_hex(resources[2]))
                                 : *resources;
        resources += coded_letter ? 3 : 1;
    }
    while (n > 1 && (path[n - 1] == '/' || path[n - 1] == '\\')) --n;
    path[n] = 0;
    return n > 0 && *resources == 0;
}

#if GIVEN_FMI == 2
/* The file: URI of a path. */
static int given_uri(const char *path, char *uri) {
    static const char *plain = "/:-._~";
    size_t n = (size_t)sprintf(uri, path[0] == '/' ? "file://" : "file:///");
    for (; *path && n + 4 < GIVEN_LONGEST; ++path) {
        const unsigned char c = (unsigned char)(*path == '\\' ? '/' : *path);
        const int letter = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        if (letter || strchr(plain, c))
            uri[n++] = (char)c;
        else
            n += (size_t)sprintf(uri + n, "%%%02X", c);
    }
    uri[n] = 0;
    return *path == 0;
}
#endif

static int given_joined(char *to, const char *one, const char *other) {
    const int count = snprintf(to, GIVEN_LONGEST, "%s%s", one, other);
    return count > 0 && count < GIVEN_LONGEST;
}

/* --- its library ------------------------------------------------------------------------------ */

static void *given_loaded(const char *path) {
#ifdef _WIN32
    return (void *)LoadLibraryExA(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
#else
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
}

static int given_function(struct given *g, const char *name, void *to) {
#ifdef _WIN32
    FARPROC found = GetProcAddress((HMODULE)g->library, name);
#else
    void *found = dlsym(g->library, name);
#endif
    memcpy(to, &found, sizeof found);
    if (!found) snprintf(g->said, sizeof g->said, "the given FMU has no function %s", name);
    return found != NULL;
}

static int given_functions(struct given *g) {
#define FOUND(name, to) given_function(g, name, (void *)&g->to)
#if GIVEN_FMI == 2
    return FOUND("fmi2FreeInstance", free_instance) && FOUND("fmi2Reset", reset) &&
           FOUND("fmi2Instantiate", instantiate) && FOUND("fmi2SetupExperiment", set_up) &&
           FOUND("fmi2EnterInitializationMode", enter) &&
           FOUND("fmi2ExitInitializationMode", leave) && FOUND("fmi2GetReal", get) &&
           FOUND("fmi2SetReal", put) && FOUND("fmi2SetBoolean", put_boolean) &&
           FOUND("fmi2SetInteger", put_integer) &&
#if GIVEN_EXCHANGE
           FOUND("fmi2NewDiscreteStates", new_states) &&
           FOUND("fmi2EnterContinuousTimeMode", go_on) &&
           FOUND("fmi2SetContinuousStates", put_states) &&
           FOUND("fmi2GetContinuousStates", get_states) &&
           FOUND("fmi2GetDerivatives", derivatives);
#else
           FOUND("fmi2DoStep", step);
#endif
#else
    return FOUND("fmi3FreeInstance", free_instance) && FOUND("fmi3Reset", reset) &&
           FOUND("fmi3InstantiateCoSimulation", instantiate) &&
           FOUND("fmi3EnterInitializationMode", enter) &&
           FOUND("fmi3ExitInitializationMode", leave) && FOUND("fmi3GetFloat64", get) &&
           FOUND("fmi3SetFloat64", put) && FOUND("fmi3SetBoolean", put_boolean) &&
           FOUND("fmi3SetInt32", put_integer) && FOUND("fmi3DoStep", step);
#endif
#undef FOUND
}

/* --- an instance ------------------------------------------------------------------------------ */

static int given_failed(struct given *g, const char *why) {
    snprintf(g->said, sizeof g->said, "the given FMU %s", why);
    g->spoilt = 1;
    return 0;
}

static int given_made(struct given *g) {
    if (g->instance) g->free_instance(g->instance);
    g->spoilt = 0;
#if GIVEN_FMI == 2
    g->instance = g->instantiate("given", GIVEN_EXCHANGE ? 0 : 1, GIVEN_TOKEN, g->resources,
                                 &g->callbacks, 0, 0);
#else
    g->instance = g->instantiate("given", GIVEN_TOKEN, g->resources, 0, 0, 0, 0, NULL, 0, NULL,
                                 (void *)given_silent, NULL);
#endif
    return g->instance ? 1 : given_failed(g, "cannot be made an instance of");
}

static int given_put(struct given *g, const given_row *rows, int count, const double *channel) {
    int i;
    for (i = 0; i < count; ++i) {
        const double value = channel[rows[i].channel] / rows[i].factor;
#if GIVEN_FMI == 2
        if (g->put(g->instance, &rows[i].variable, 1, &value) > 1)
#else
        if (g->put(g->instance, &rows[i].variable, 1, &value, 1) > 1)
#endif
            return given_failed(g, "refused a value");
    }
    return 1;
}

static int given_settled(struct given *g) {
    int i, status;
    for (i = 0; i < GIVEN_PARAMETERS; ++i) {
        const unsigned *which = &given_set[i].variable;
        const double real = given_set[i].value;
        const int whole = (int)real;
#if GIVEN_FMI == 2
        status = given_set[i].kind == 1   ? g->put_boolean(g->instance, which, 1, &whole)
                 : given_set[i].kind == 2 ? g->put_integer(g->instance, which, 1, &whole)
                                          : g->put(g->instance, which, 1, &real);
#else
        const _Bool truth = whole != 0;
        status = given_set[i].kind == 1   ? g->put_boolean(g->instance, which, 1, &truth, 1)
                 : given_set[i].kind == 2 ? g->put_integer(g->instance, which, 1, &whole, 1)
                                          : g->put(g->instance, which, 1, &real, 1);
#endif
        if (status > 1) return given_failed(g, "refused a parameter");
    }
    return 1;
}

static int given_initialised(struct given *g) {
#if GIVEN_FMI == 2
    if (g->set_up(g->instance, 0, 0.0, 0.0, 0, 0.0) > 1 || g->enter(g->instance) > 1 ||
        g->leave(g->instance) > 1)
        return given_failed(g, "refused its start");
#if GIVEN_EXCHANGE
    {
        given_events events;
        int i;
        memset(&events, 0, sizeof events);
        events.more = 1;
        for (i = 0; i < GIVEN_MOST_EVENTS && events.more; ++i)
            if (g->new_states(g->instance, &events) > 1 || events.end)
                return given_failed(g, "ended at its start");
        if (g->go_on(g->instance) > 1) return given_failed(g, "refused its start");
    }
#endif
#else
    if (g->enter(g->instance, 0, 0.0, 0.0, 0, 0.0) > 1 || g->leave(g->instance) > 1)
        return given_failed(g, "refused its start");
#endif
    return 1;
}

static int given_begin(struct given *g, const double *channel) {
    if (!(g->instance && !g->spoilt && g->reset(g->instance) <= 1) && !given_made(g)) return 0;
    return given_settled(g) && given_put(g, given_start, GIVEN_STARTS, channel) &&
           given_put(g, given_input, GIVEN_INPUTS, channel) && given_initialised(g) &&
           given_put(g, given_input, GIVEN_INPUTS, channel);
}

/* --- what it is asked ------------------------------------------------------------------------- */

#if GIVEN_EXCHANGE
static int given_asked(struct given *g, const double *channel, double *found) {
    int i;
    if (!g->begun) { /* states that are not the ship's are as at a start */
        if (!given_begin(g, channel)) return 0;
        if (g->get_states(g->instance, g->first, GIVEN_STATES) > 1)
            return given_failed(g, "refused to give its states");
        g->begun = 1;
    }
    memcpy(g->z, g->first, sizeof g->z);
    for (i = 0; i < GIVEN_PLACES; ++i)
        g->z[given_place[i].variable] = channel[given_place[i].channel] / given_place[i].factor;
    if (!given_put(g, given_input, GIVEN_INPUTS, channel)) return 0;
    if (g->put_states(g->instance, g->z, GIVEN_STATES) > 1)
        return given_failed(g, "refused its states");
    if (g->derivatives(g->instance, g->f, GIVEN_STATES) > 1)
        return given_failed(g, "refused to give its derivatives");
    for (i = 0; i < 3; ++i) found[i] = g->f[given_moving[i]] * given_velocity[i].factor;
    return 1;
}
#else
static int given_asked(struct given *g, const double *channel, double *found) {
    const double h = GIVEN_SHORT;
    double after[2][3];
    int i, k;
    if (!given_begin(g, channel)) return 0;
    for (k = 0; k < 2; ++k) {
#if GIVEN_FMI == 2
        if (g->step(g->instance, k * h, h, 1) > 1) return given_failed(g, "refused a step");
#else
        _Bool event, end, early;
        double last;
        if (g->step(g->instance, k * h, h, 1, &event, &end, &early, &last) > 1)
            return given_failed(g, "refused a step");
#endif
        for (i = 0; i < 3; ++i) {
#if GIVEN_FMI == 2
            if (g->get(g->instance, &given_velocity[i].variable, 1, &after[k][i]) > 1)
#else
            if (g->get(g->instance, &given_velocity[i].variable, 1, &after[k][i], 1) > 1)
#endif
                return given_failed(g, "refused to give its velocities");
            after[k][i] *= given_velocity[i].factor;
        }
    }
    for (i = 0; i < 3; ++i)
        found[i] = (-3.0 * channel[2 * i + 1] + 4.0 * after[0][i] - after[1][i]) / (2.0 * h);
    return 1;
}
#endif

/* Accelerations [3] of the ship through water that goes `water` over what x is relative to. They are
 * added to what causes add. x: the state, the actuators, the true wind along x0 and y0; turn: cosine
 * and sine of the heading. No number where it failed: g->said says how. */
static void given_accelerations(struct given *g, const double *x, const double *turn,
                                const double *water, double *acceleration) {
    double channel[6 + @NAME@_ACTUATORS + 6], found[3] = {NAN, NAN, NAN};
    const double c = turn[0], s = turn[1];
    double *wind = channel + 6 + @NAME@_ACTUATORS, north, east, ahead, starboard;
    int i;
    memcpy(channel, x, (6 + @NAME@_ACTUATORS) * sizeof(double));
    channel[1] -= c * water[0] + s * water[1];
    channel[3] -= c * water[1] - s * water[0];
    north = x[6 + @NAME@_ACTUATORS] + water[0];
    east = x[7 + @NAME@_ACTUATORS] + water[1];
    ahead = c * north + s * east + channel[1];
    starboard = c * east - s * north + channel[3];
    wind[0] = hypot(ahead, starboard);
    wind[1] = atan2(starboard, ahead);
    wind[2] = north;
    wind[3] = east;
    wind[4] = hypot(north, east);
    wind[5] = atan2(east, north);
    for (i = 0; i < 6 + @NAME@_ACTUATORS + 6; ++i)
        if (!(fabs(channel[i]) < HUGE_VAL)) break;
    if (i < 6 + @NAME@_ACTUATORS + 6 || !given_asked(g, channel, found))
        found[0] = found[1] = found[2] = NAN;
    for (i = 0; i < 3; ++i) acceleration[i] += found[i];
}

/* --- its life --------------------------------------------------------------------------------- */

static void given_close(struct given *g) {
    if (!g) return;
    if (g->instance) g->free_instance(g->instance);
#ifdef _WIN32
    if (g->library) FreeLibrary((HMODULE)g->library);
#else
    if (g->library) dlclose(g->library);
#endif
    free(g);
}

/* From the resources of this FMU. NULL, and `said` [200], where it cannot be opened. */
static struct given *given_open(const char *resources, char *said) {
    struct given *g = (struct given *)calloc(1, sizeof *g);
    char file[GIVEN_LONGEST], path[GIVEN_LONGEST];
    said[0] = 0;
    if (!g) return NULL;
    g->callbacks.logger = given_no_log;
    g->callbacks.allocate = calloc;
    g->callbacks.release = free;
    if (!resources || !given_path(resources, path) || !given_joined(g->folder, path, "/given")) {
        snprintf(said, 200, "the folder of its resources is not known");
        free(g);
        return NULL;
    }
#if GIVEN_FMI == 2
    given_joined(path, g->folder, "/binaries/" GIVEN_SHORT_NAME "/" GIVEN_IDENTIFIER GIVEN_ENDING);
    given_joined(file, g->folder, "/resources");
    given_uri(file, g->resources);
#else
    given_joined(path, g->folder,
                 "/binaries/" GIVEN_MACHINE GIVEN_SYSTEM "/" GIVEN_IDENTIFIER GIVEN_ENDING);
    given_joined(g->resources, g->folder, "/resources/");
    (void)file;
#endif
    g->library = given_loaded(path);
    if (!g->library) {
        snprintf(said, 200, "the given FMU has no library here that can be opened");
    } else if (given_functions(g) && given_made(g)) {
        return g;
    } else {
        snprintf(said, 200, "%s", g->said);
    }
    given_close(g);
    return NULL;
}

#endif
