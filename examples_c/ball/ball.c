/* A ball as an FMU for co-simulation, FMI 2.0: a rigid body under gravity and the force and torque of
 * whatever it meets. python/examples/ball_on_cloth.py packs it and lets it fall onto a cloth FMU.
 *
 * Within a step force and torque are constant, for which the motion of the centre is exact; the turn
 * is that of the mean angular velocity. Value references:
 *
 *   0 mass   1 radius   2 gravity (along y)              parameters, fixed
 *   3..5 force   6..8 torque                             inputs
 *   9..11 position   12..15 quaternion x y z w           outputs, start values of position
 *   16..18 velocity   19..21 angular velocity            outputs, start values
 *   22 kinetic energy   23 potential energy              outputs
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define TOKEN "{0a6f5a52-7d0e-4a44-9d0c-ba110000ba11}"

enum { MASS, RADIUS, GRAVITY, FORCE, TORQUE = 6, POSITION = 9, QUATERNION = 12 };
enum { VELOCITY = 16, SPIN = 19, KINETIC = 22, POTENTIAL, COUNT };

typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED } mode;

typedef struct {
    double values[COUNT];
    double time;
    mode mode;
} ball_state;

typedef struct {
    ball_state state;
    fmi2CallbackFunctions callbacks;
    char *name;
} ball;

static const double STARTS[COUNT] = {
    [MASS] = 0.05, [RADIUS] = 0.1, [GRAVITY] = -9.81, [POSITION + 1] = 0.9, [QUATERNION + 3] = 1};

static void energies(double v[COUNT]) {
    const double inertia = 0.4 * v[MASS] * v[RADIUS] * v[RADIUS];
    double linear = 0, angular = 0;
    for (int k = 0; k < 3; ++k) {
        linear += v[VELOCITY + k] * v[VELOCITY + k];
        angular += v[SPIN + k] * v[SPIN + k];
    }
    v[KINETIC] = 0.5 * (v[MASS] * linear + inertia * angular);
    v[POTENTIAL] = -v[MASS] * v[GRAVITY] * v[POSITION + 1];
}

static void reset(ball *b) {
    memcpy(b->state.values, STARTS, sizeof STARTS);
    b->state.time = 0;
    b->state.mode = INSTANTIATED;
}

/* An error is told and ends the run. */
static fmi2Status refuse(ball *b, const char *why) {
    if (b == NULL) return fmi2Error;
    b->state.mode = TERMINATED;
    if (b->callbacks.logger != NULL)
        b->callbacks.logger(b->callbacks.componentEnvironment, b->name, fmi2Error, "logStatusError", "%s",
                            why);
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    if (name == NULL || token == NULL || functions == NULL || type != fmi2CoSimulation) return NULL;
    if (strcmp(token, TOKEN) != 0) return NULL;
    ball *b = calloc(1, sizeof *b);
    if (b == NULL) return NULL;
    b->callbacks = *functions;
    b->name = malloc(strlen(name) + 1);
    if (b->name == NULL) {
        free(b);
        return NULL;
    }
    strcpy(b->name, name);
    reset(b);
    return b;
}

void fmi2FreeInstance(fmi2Component c) {
    ball *b = c;
    if (b == NULL) return;
    free(b->name);
    free(b);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String names[]) {
    (void)on, (void)count, (void)names;
    return c == NULL ? fmi2Error : fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    ball *b = c;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    if (b == NULL || b->state.mode != INSTANTIATED || !isfinite(start))
        return refuse(b, "fmi2SetupExperiment: not now, or the start time is no number");
    b->state.time = start;
    return fmi2OK;
}

static fmi2Status change(ball *b, mode from, mode to, const char *why) {
    if (b == NULL || b->state.mode != from) return refuse(b, why);
    b->state.mode = to;
    energies(b->state.values);
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return change(c, INSTANTIATED, INITIALIZATION, "fmi2EnterInitializationMode: not now");
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return change(c, INITIALIZATION, STEPPING, "fmi2ExitInitializationMode: not now");
}
fmi2Status fmi2Terminate(fmi2Component c) {
    return change(c, STEPPING, TERMINATED, "fmi2Terminate: not now");
}

fmi2Status fmi2Reset(fmi2Component c) {
    if (c == NULL) return fmi2Error;
    reset(c);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real value[]) {
    ball *b = c;
    if (b == NULL) return fmi2Error;
    if (b->state.mode != STEPPING) energies(b->state.values);
    for (size_t i = 0; i < count; ++i) {
        if (vr[i] >= COUNT) return refuse(b, "fmi2GetReal: no such variable");
        value[i] = b->state.values[vr[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                       const fmi2Real value[]) {
    ball *b = c;
    if (b == NULL) return fmi2Error;
    for (size_t i = 0; i < count; ++i) {
        const int input = vr[i] >= FORCE && vr[i] < POSITION;
        const int starts = b->state.mode == INSTANTIATED || b->state.mode == INITIALIZATION;
        if (vr[i] >= KINETIC || !(input || starts) || b->state.mode == TERMINATED)
            return refuse(b, "fmi2SetReal: this variable cannot be set, or not now");
        if (!isfinite(value[i]) || (vr[i] <= RADIUS && value[i] <= 0))
            return refuse(b, "fmi2SetReal: not a number that can be");
        b->state.values[vr[i]] = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real h, fmi2Boolean no_set_state) {
    ball *b = c;
    (void)no_set_state;
    if (b == NULL || b->state.mode != STEPPING) return refuse(b, "fmi2DoStep: not now");
    if (!(isfinite(h) && h > 0) || !(fabs(point - b->state.time) <= 1e-9 * fmax(1, fabs(point))))
        return refuse(b, "fmi2DoStep: not a step from the time that was reached");
    double *v = b->state.values, turn[3], angle = 0;
    const double inertia = 0.4 * v[MASS] * v[RADIUS] * v[RADIUS];
    for (int k = 0; k < 3; ++k) {
        const double a = v[FORCE + k] / v[MASS] + (k == 1 ? v[GRAVITY] : 0);
        const double spin = v[SPIN + k] + h * v[TORQUE + k] / inertia;
        v[POSITION + k] += h * v[VELOCITY + k] + 0.5 * h * h * a;
        v[VELOCITY + k] += h * a;
        turn[k] = 0.5 * h * (v[SPIN + k] + spin);
        v[SPIN + k] = spin;
        angle += turn[k] * turn[k];
    }
    angle = sqrt(angle);
    if (angle > 0) {
        const double s = sin(0.5 * angle) / angle, w = cos(0.5 * angle);
        const double *q = v + QUATERNION;
        const double p[4] = {s * turn[0], s * turn[1], s * turn[2], w};
        const double r[4] = {p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
                             p[3] * q[1] + p[1] * q[3] + p[2] * q[0] - p[0] * q[2],
                             p[3] * q[2] + p[2] * q[3] + p[0] * q[1] - p[1] * q[0],
                             p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]};
        const double length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
        for (int k = 0; k < 4; ++k) v[QUATERNION + k] = r[k] / length;
    }
    b->state.time = point + h;
    energies(v);
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    ball *b = c;
    if (b == NULL || state == NULL) return refuse(b, "fmi2GetFMUstate: NULL");
    if (*state == NULL) *state = malloc(sizeof b->state);
    if (*state == NULL) return refuse(b, "fmi2GetFMUstate: no memory");
    memcpy(*state, &b->state, sizeof b->state);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    ball *b = c;
    if (b == NULL || state == NULL) return refuse(b, "fmi2SetFMUstate: NULL");
    memcpy(&b->state, state, sizeof b->state);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (c == NULL) return fmi2Error;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    ball *b = c;
    if (b == NULL || kind != fmi2LastSuccessfulTime || value == NULL)
        return refuse(b, "fmi2GetRealStatus: only fmi2LastSuccessfulTime is a number");
    *value = b->state.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    ball *b = c;
    if (b == NULL || kind != fmi2Terminated || value == NULL)
        return refuse(b, "fmi2GetBooleanStatus: only fmi2Terminated is a truth value");
    *value = b->state.mode == TERMINATED;
    return fmi2OK;
}

/* What the ball does not offer. */
#define REFUSED(name, ...) \
    fmi2Status name(fmi2Component c, __VA_ARGS__) { return refuse(c, #name ": not offered"); }
#define REFUSED0(name) \
    fmi2Status name(fmi2Component c) { return refuse(c, #name ": not offered"); }

#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define LIST const fmi2ValueReference vr[], size_t count

/* a list of nothing is no error */
#define NONE_OF(name, type) \
    fmi2Status name(fmi2Component c, LIST, type value[]) { \
        return c != NULL && count == 0 ? fmi2OK : refuse(c, #name ": no such variable"); \
    }

NONE_OF(fmi2GetInteger, fmi2Integer)
NONE_OF(fmi2GetBoolean, fmi2Boolean)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const fmi2Integer)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)
REFUSED(fmi2SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
REFUSED(fmi2SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
REFUSED(fmi2DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
REFUSED(fmi2GetDirectionalDerivative, LIST, const fmi2ValueReference known[], size_t knowns,
        const fmi2Real seed[], fmi2Real sensitivity[])
REFUSED(fmi2SetRealInputDerivatives, LIST, const fmi2Integer order[], const fmi2Real value[])
REFUSED(fmi2GetRealOutputDerivatives, LIST, const fmi2Integer order[], fmi2Real value[])
REFUSED0(fmi2CancelStep)
REFUSED(fmi2GetStatus, const fmi2StatusKind kind, fmi2Status *value)
REFUSED(fmi2GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
REFUSED(fmi2GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
REFUSED0(fmi2EnterEventMode)
REFUSED(fmi2NewDiscreteStates, fmi2EventInfo *info)
REFUSED0(fmi2EnterContinuousTimeMode)
REFUSED(fmi2CompletedIntegratorStep, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *end)
REFUSED(fmi2SetTime, fmi2Real time)
REFUSED(fmi2SetContinuousStates, const fmi2Real x[], size_t count)
REFUSED(fmi2GetDerivatives, fmi2Real derivatives[], size_t count)
REFUSED(fmi2GetEventIndicators, fmi2Real indicators[], size_t count)
REFUSED(fmi2GetContinuousStates, fmi2Real x[], size_t count)
REFUSED(fmi2GetNominalsOfContinuousStates, fmi2Real nominals[], size_t count)
