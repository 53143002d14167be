/* The tanker of tanker.py as an FMU for co-simulation, FMI 2.0 and 3.0: no header of anybody's.

   What is wrong with it is chosen when it is compiled:
   -DREFUSE=30   it refuses a step from 30 s on          -DBLANK=30    its surge is no number then
   -DRESTART=30  its time begins again at 30 s           -DCRASH=30    its process ends
*/
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define PI 3.14159265358979323846
#define WATER 998.0
#define AIR 1.225
#define L 3.0
#define D 0.201
#define INNER 0.02
#define KNOT (1852.0 / 3600.0)

enum { X0, SURGE, Y0, SWAY, HEADING, YAW_RATE, STATES };
/* value references: 0-5 outputs, 10-15 starts, 20-24 inputs, 30 time */

typedef struct {
    double state[STATES], start[STATES], input[5], time;
} Ship;

static const double XI[12] = {
    -0.49078031712335963, -0.45205862818523743, -0.38495133709715235, -0.29365897714330872,
    -0.18391574949909010, -0.06261670425573458, 0.06261670425573458, 0.18391574949909010,
    0.29365897714330872, 0.38495133709715235, 0.45205862818523743, 0.49078031712335963};
static const double WIDTH[12] = {
    0.02358766819325591, 0.05346966299765922, 0.08003916427167311, 0.10158371336153296,
    0.11674626826917740, 0.12457352290670139, 0.12457352290670139, 0.11674626826917740,
    0.10158371336153296, 0.08003916427167311, 0.05346966299765922, 0.02358766819325591};

static void blade(double angle, double u, double v, double *x, double *y) {
    double speed = sqrt(u * u + v * v), attack = angle + atan2(v, u);
    double s = sin(attack), k = cos(attack), steep = asin(fmin(1.0, fabs(s)));
    double attached = 1.0 / (1.0 + exp((steep - 0.62) / 0.06));
    double lift = (attached * 2.6 + (1.0 - attached) * 1.25) * s * k;
    double drag = 0.025 + (attached * 0.45 + (1.0 - attached)) * 1.25 * s * s;
    double q = 0.5 * WATER * 0.0103 * 0.40 * speed;
    *x = q * (-drag * u + lift * v);
    *y = q * (-drag * v - lift * u);
}

static void rates(const double *x, const double *in, double *out) {
    double u = x[SURGE], v = x[SWAY], r = x[YAW_RATE], psi = x[HEADING], lr = L * r;
    double q = 0.5 * WATER * L * D, speed = sqrt(u * u + v * v);
    double astern = 0.5 - 0.5 * u / fmax(speed, 1e-12);
    double fx = q * (-(0.0230 + 0.0100 * astern) * u * speed - 0.17 * v * lr);
    double fy = q * (-0.34 * v * fabs(u) + 0.10 * lr * u);
    double fn = q * L * (-0.13 * v * u - 0.065 * lr * fabs(u));
    int i;
    for (i = 0; i < 12; i++) {
        double across = v + lr * XI[i];
        double push = q * 0.86 * (1.0 + 2.2 * XI[i] * XI[i]) * WIDTH[i] * fabs(across) * across;
        fy -= push;
        fn -= push * XI[i] * L;
    }
    double aside = v - 1.42 * r, ahead = u * u / fmax(u * u + aside * aside, 1e-12);
    double inflow = u > 0.0 ? u * (1.0 - 0.45 * ahead * ahead) : u, nd = 0.100 * in[2];
    double thrust = WATER * 0.01 *
        (nd * nd * 0.335 - nd * inflow * 0.310 - inflow * fabs(inflow) * 0.160);
    fx += 0.80 * thrust;
    double disc = 0.25 * PI * 0.01;
    double far = sqrt(fmax(inflow * inflow + 2.0 * thrust / (WATER * disc), 0.0));
    double jet = WATER * disc * 0.5 * fmax(inflow + far, 0.0) * far;
    double past = 0.60 * (v - 1.50 * r), spread = sqrt(far * far + past * past) + 1e-9;
    for (i = 0; i < 2; i++) {
        double share = i ? 0.485 : 0.515, station = i ? 0.075 : -0.075, turned = in[i] + 0.025;
        double across = sin(turned) * far / spread + cos(in[i]) * past / spread;
        double leaves = 0.93 * (1.0 - 0.10 * across * across), bx, by;
        blade(in[i], u > 0.0 ? u * (1.0 - 0.5 * 0.45) : u, past, &bx, &by);
        double rx = -share * jet * (far / spread - leaves * cos(turned)) + bx;
        double ry = -share * jet * (past / spread + leaves * sin(turned)) + by;
        fx += rx;
        fy += ry * 1.20;
        fn += ry * (-1.50 - 0.20 * 1.30) - rx * station;
    }
    double wa = in[3] * cos(psi) + in[4] * sin(psi) + u;
    double ws = -in[3] * sin(psi) + in[4] * cos(psi) + v;
    double angle = atan2(ws, wa), air = 0.5 * AIR * (wa * wa + ws * ws);
    fx += -air * 0.135 * (0.80 * cos(angle) - 0.07 * cos(3.0 * angle));
    fy += -air * 0.520 * (1.02 * sin(angle) + 0.06 * sin(3.0 * angle));
    fn += -air * 0.520 * L * (0.020 * sin(angle) + 0.100 * sin(2.0 * angle));
    double mx = 261.6, my = 465.6, moment = 244.6 * 0.094, inertia = 240.0;
    double ya = fy - mx * u * r, na = fn - moment * u * r, det = my * inertia - moment * moment;
    out[X0] = u * cos(psi) - v * sin(psi);
    out[SURGE] = (fx + my * v * r + moment * r * r) / mx;
    out[Y0] = u * sin(psi) + v * cos(psi);
    out[SWAY] = (ya * inertia - moment * na) / det;
    out[HEADING] = r;
    out[YAW_RATE] = (my * na - moment * ya) / det;
}

static void advance(Ship *s, double h) {
    double k[4][STATES], x[STATES];
    int stage, i;
    for (stage = 0; stage < 4; stage++) {
        double part = stage == 0 ? 0.0 : stage == 3 ? 1.0 : 0.5;
        for (i = 0; i < STATES; i++)
            x[i] = s->state[i] + (stage ? part * h * k[stage - 1][i] : 0.0);
        rates(x, s->input, k[stage]);
    }
    for (i = 0; i < STATES; i++)
        s->state[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
}

static int step(Ship *s, double h) {
    int count = (int)ceil(h / INNER - 1e-9), i;
#ifdef REFUSE
    if (s->time >= REFUSE) return 2;
#endif
#ifdef CRASH
    if (s->time >= CRASH) abort();
#endif
    for (i = 0; i < count; i++) advance(s, h / count);
    s->time += h;
#ifdef BLANK
    if (s->time >= BLANK) s->state[SURGE] = NAN;
#endif
#ifdef RESTART
    if (s->time >= RESTART) s->time = 0.0;
#endif
    return 0;
}

static double unit(unsigned reference) { return reference % 10 == SURGE ? KNOT : 1.0; }

static int get(const Ship *s, unsigned reference, double *value) {
    if (reference < STATES) *value = s->state[reference] / unit(reference);
    else if (reference == 30) *value = s->time;
    else if (reference >= 10 && reference < 16) *value = s->start[reference - 10] / unit(reference);
    else if (reference >= 20 && reference < 25) *value = s->input[reference - 20];
    else return 3;
    return 0;
}

static int set(Ship *s, unsigned reference, double value) {
    if (reference >= 10 && reference < 16) s->start[reference - 10] = value * unit(reference);
    else if (reference == 20 || reference == 21) s->input[reference - 20] = value * PI / 180.0;
    else if (reference == 22) s->input[2] = value / 60.0;
    else if (reference == 23 || reference == 24) s->input[reference - 20] = value;
    else return 3;
    return 0;
}

static int begin(Ship *s) {
    memcpy(s->state, s->start, sizeof s->state);
    s->time = 0.0;
    return 0;
}

typedef Ship *Instance;
typedef const char *Text;

/* FMI 2.0 */
EXPORT Text fmi2GetTypesPlatform(void) { return "default"; }
EXPORT Text fmi2GetVersion(void) { return "2.0"; }
EXPORT Instance fmi2Instantiate(Text n, int t, Text g, Text r, const void *f, int v, int l) {
    return calloc(1, sizeof(Ship));
}
EXPORT void fmi2FreeInstance(Instance s) { free(s); }
EXPORT int fmi2SetDebugLogging(Instance s, int on, size_t n, const Text *c) { return 0; }
EXPORT int fmi2SetupExperiment(Instance s, int a, double b, double c, int d, double e) { return 0; }
EXPORT int fmi2EnterInitializationMode(Instance s) { return 0; }
EXPORT int fmi2ExitInitializationMode(Instance s) { return begin(s); }
EXPORT int fmi2Terminate(Instance s) { return 0; }
EXPORT int fmi2Reset(Instance s) { memset(s, 0, sizeof *s); return 0; }
EXPORT int fmi2GetReal(Instance s, const unsigned *r, size_t n, double *v) {
    size_t i; int bad = 0;
    for (i = 0; i < n; i++) bad |= get(s, r[i], v + i);
    return bad;
}
EXPORT int fmi2SetReal(Instance s, const unsigned *r, size_t n, const double *v) {
    size_t i; int bad = 0;
    for (i = 0; i < n; i++) bad |= set(s, r[i], v[i]);
    return bad;
}
EXPORT int fmi2DoStep(Instance s, double t, double h, int n) { return step(s, h); }
/* FMI 2.0, model exchange; value references 40-45 are derivatives */
typedef struct { int more, end, nominals, values, next; double time; } Events;
EXPORT int fmi2EnterEventMode(Instance s) { return 0; }
EXPORT int fmi2NewDiscreteStates(Instance s, Events *e) { memset(e, 0, sizeof *e); return 0; }
EXPORT int fmi2EnterContinuousTimeMode(Instance s) { return 0; }
EXPORT int fmi2CompletedIntegratorStep(Instance s, int n, int *e, int *t) { return *e = *t = 0; }
EXPORT int fmi2SetTime(Instance s, double t) { s->time = t; return 0; }
EXPORT int fmi2SetContinuousStates(Instance s, const double *x, size_t n) {
    size_t i;
    for (i = 0; i < n; i++) s->state[i] = x[i] * unit(i);
    return 0;
}
EXPORT int fmi2GetContinuousStates(Instance s, double *x, size_t n) {
    size_t i;
    for (i = 0; i < n; i++) x[i] = s->state[i] / unit(i);
    return 0;
}
EXPORT int fmi2GetDerivatives(Instance s, double *x, size_t n) {
    size_t i;
#ifdef BLANK
    if (s->time >= BLANK) return 3;
#endif
    rates(s->state, s->input, x);
    for (i = 0; i < n; i++) x[i] /= unit(i);
    return 0;
}
EXPORT int fmi2GetEventIndicators(Instance s, double *x, size_t n) { return 0; }
EXPORT int fmi2GetNominalsOfContinuousStates(Instance s, double *x, size_t n) { return 0; }
EXPORT int fmi2GetDirectionalDerivative(
    Instance s, const unsigned *unknown, size_t n, const unsigned *known, size_t m,
    const double *by, double *found) {
    double up[STATES], down[STATES], h = 1e-6;
    Ship moved = *s;
    size_t i, side;
    for (side = 0; side < 2; side++) {
        double sign = side ? -1.0 : 1.0;
        moved = *s;
        for (i = 0; i < m; i++) {
            double change = sign * h * by[i];
            if (known[i] < STATES) moved.state[known[i]] += change * unit(known[i]);
            else if (known[i] <= 21) moved.input[known[i] - 20] += change * PI / 180.0;
            else moved.input[known[i] - 20] += known[i] == 22 ? change / 60.0 : change;
        }
        rates(moved.state, moved.input, side ? down : up);
    }
    for (i = 0; i < n; i++)
        found[i] = (up[unknown[i] - 40] - down[unknown[i] - 40]) / (2.0 * h) / unit(unknown[i] - 40);
    return 0;
}
#define NONE(name, ...) EXPORT int name(__VA_ARGS__) { return 3; }
NONE(fmi2GetInteger, void) NONE(fmi2GetBoolean, void) NONE(fmi2GetString, void)
NONE(fmi2SetInteger, void) NONE(fmi2SetBoolean, void) NONE(fmi2SetString, void)
NONE(fmi2GetFMUstate, void) NONE(fmi2SetFMUstate, void) NONE(fmi2FreeFMUstate, void)
NONE(fmi2SerializedFMUstateSize, void) NONE(fmi2SerializeFMUstate, void)
NONE(fmi2DeSerializeFMUstate, void)
NONE(fmi2SetRealInputDerivatives, void) NONE(fmi2GetRealOutputDerivatives, void)
NONE(fmi2CancelStep, void) NONE(fmi2GetStatus, void) NONE(fmi2GetRealStatus, void)
NONE(fmi2GetIntegerStatus, void) NONE(fmi2GetBooleanStatus, void) NONE(fmi2GetStringStatus, void)

/* FMI 3.0 */
EXPORT Text fmi3GetVersion(void) { return "3.0"; }
EXPORT Instance fmi3InstantiateCoSimulation(
    Text n, Text g, Text r, int v, int l, int e, int early, const unsigned *q, size_t m, void *env,
    void *log, void *inter) { return calloc(1, sizeof(Ship)); }
EXPORT void fmi3FreeInstance(Instance s) { free(s); }
EXPORT int fmi3EnterInitializationMode(Instance s, int a, double b, double c, int d, double e) {
    return 0;
}
EXPORT int fmi3ExitInitializationMode(Instance s) { return begin(s); }
EXPORT int fmi3Terminate(Instance s) { return 0; }
EXPORT int fmi3Reset(Instance s) { memset(s, 0, sizeof *s); return 0; }
EXPORT int fmi3GetFloat64(Instance s, const unsigned *r, size_t n, double *v, size_t m) {
    return fmi2GetReal(s, r, n, v);
}
EXPORT int fmi3SetFloat64(Instance s, const unsigned *r, size_t n, const double *v, size_t m) {
    return fmi2SetReal(s, r, n, v);
}
EXPORT int fmi3DoStep(
    Instance s, double t, double h, _Bool n, _Bool *event, _Bool *end, _Bool *early, double *last) {
    int status = step(s, h);
    *event = *end = *early = 0;
    *last = t + h;
    return status;
}
NONE(fmi3SetDebugLogging, void) NONE(fmi3InstantiateModelExchange, void)
NONE(fmi3InstantiateScheduledExecution, void) NONE(fmi3EnterEventMode, void)
NONE(fmi3ActivateModelPartition, void) NONE(fmi3CompletedIntegratorStep, void)
NONE(fmi3DeserializeFMUState, void) NONE(fmi3EnterConfigurationMode, void)
NONE(fmi3EnterContinuousTimeMode, void) NONE(fmi3EnterStepMode, void)
NONE(fmi3EvaluateDiscreteStates, void) NONE(fmi3ExitConfigurationMode, void)
NONE(fmi3FreeFMUState, void) NONE(fmi3GetAdjointDerivative, void)
NONE(fmi3GetBinary, void) NONE(fmi3GetBoolean, void)
NONE(fmi3GetClock, void) NONE(fmi3GetContinuousStateDerivatives, void)
NONE(fmi3GetContinuousStates, void) NONE(fmi3GetDirectionalDerivative, void)
NONE(fmi3GetEventIndicators, void) NONE(fmi3GetFMUState, void)
NONE(fmi3GetFloat32, void) NONE(fmi3GetInt16, void)
NONE(fmi3GetInt32, void) NONE(fmi3GetInt64, void)
NONE(fmi3GetInt8, void) NONE(fmi3GetIntervalDecimal, void)
NONE(fmi3GetIntervalFraction, void) NONE(fmi3GetNominalsOfContinuousStates, void)
NONE(fmi3GetNumberOfContinuousStates, void) NONE(fmi3GetNumberOfEventIndicators, void)
NONE(fmi3GetNumberOfVariableDependencies, void) NONE(fmi3GetOutputDerivatives, void)
NONE(fmi3GetShiftDecimal, void) NONE(fmi3GetShiftFraction, void)
NONE(fmi3GetString, void) NONE(fmi3GetUInt16, void)
NONE(fmi3GetUInt32, void) NONE(fmi3GetUInt64, void)
NONE(fmi3GetUInt8, void) NONE(fmi3GetVariableDependencies, void)
NONE(fmi3SerializeFMUState, void) NONE(fmi3SerializedFMUStateSize, void)
NONE(fmi3SetBinary, void) NONE(fmi3SetBoolean, void)
NONE(fmi3SetClock, void) NONE(fmi3SetContinuousStates, void)
NONE(fmi3SetFloat32, void) NONE(fmi3SetInt16, void)
NONE(fmi3SetInt32, void) NONE(fmi3SetInt64, void)
NONE(fmi3SetInt8, void) NONE(fmi3SetIntervalDecimal, void)
NONE(fmi3SetIntervalFraction, void) NONE(fmi3SetShiftDecimal, void)
NONE(fmi3SetShiftFraction, void) NONE(fmi3SetString, void)
NONE(fmi3SetTime, void) NONE(fmi3SetUInt16, void)
NONE(fmi3SetUInt32, void) NONE(fmi3SetUInt64, void)
NONE(fmi3SetUInt8, void) NONE(fmi3UpdateDiscreteStates, void)
NONE(fmi3SetFMUState, void)
