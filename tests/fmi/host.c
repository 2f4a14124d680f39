/* A master in C over the official headers of FMI: compiled with every warning an error, run under
 * valgrind. Loads an FMU's library, drives it, saves and restores, unloads it; prints a position, and
 * the least that was allocated after a cycle of the second tenth and of the last one [byte].
 *
 *   host LIBRARY VERSION TOKEN RESOURCES POSITION_REFERENCE CYCLES
 */
#include <dlfcn.h>
#include <malloc.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

#define HOLDS(law)                                                          \
    do {                                                                    \
        if (!(law)) {                                                       \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #law);       \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

static void *library;

/* the pointer of a function, without a cast that ISO C does not have */
static void find(const char *name, void *function, size_t size) {
    void *symbol = dlsym(library, name);
    HOLDS(symbol != NULL && size == sizeof symbol);
    memcpy(function, &symbol, size);
}
#define FIND(name)     \
    name##TYPE *name##_; \
    find(#name, &name##_, sizeof name##_)

static int lines;

static void tell3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                 fmi3String message) {
    HOLDS(environment == &lines && status == fmi3Error && category && message[0]);
    ++lines;
}

static void tell2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                 fmi2String category, fmi2String message, ...) {
    HOLDS(environment == &lines && strcmp(name, "cloth") == 0 && status == fmi2Error);
    HOLDS(category && message[0]);
    ++lines;
}

static double three(const char *token, const char *resources, fmi3ValueReference position) {
    FIND(fmi3GetVersion);
    FIND(fmi3InstantiateCoSimulation);
    FIND(fmi3EnterInitializationMode);
    FIND(fmi3ExitInitializationMode);
    FIND(fmi3DoStep);
    FIND(fmi3GetFloat64);
    FIND(fmi3SetFloat64);
    FIND(fmi3GetFMUState);
    FIND(fmi3SetFMUState);
    FIND(fmi3FreeFMUState);
    FIND(fmi3SerializedFMUStateSize);
    FIND(fmi3SerializeFMUState);
    FIND(fmi3DeserializeFMUState);
    FIND(fmi3GetDirectionalDerivative);
    FIND(fmi3Reset);
    FIND(fmi3Terminate);
    FIND(fmi3FreeInstance);
    HOLDS(strcmp(fmi3GetVersion_(), fmi3Version) == 0);
    fmi3Instance cloth = fmi3InstantiateCoSimulation_("cloth", token, resources, fmi3False, fmi3False,
                                                      fmi3False, fmi3False, NULL, 0, &lines, tell3, NULL);
    HOLDS(cloth != NULL);
    const fmi3ValueReference gravity = 1;
    fmi3Float64 g = 0.5, x = 0, again = 0, reached = -1;
    double time = 0;
    HOLDS(fmi3SetFloat64_(cloth, &gravity, 1, &g, 1) == fmi3OK);
    HOLDS(fmi3EnterInitializationMode_(cloth, fmi3False, 0, 0, fmi3True, 1) == fmi3OK);
    HOLDS(fmi3ExitInitializationMode_(cloth) == fmi3OK);
    fmi3FMUState state = NULL, copy = NULL;
    for (int i = 0; i < 6; ++i, time += 0.01) {
        fmi3Boolean event = fmi3True, end = fmi3True, early = fmi3True;
        HOLDS(fmi3DoStep_(cloth, time, 0.01, fmi3False, &event, &end, &early, &reached) == fmi3OK);
        HOLDS(!event && !end && !early);
        if (i == 2) HOLDS(fmi3GetFMUState_(cloth, &state) == fmi3OK);
    }
    HOLDS(reached > 0.0599 && reached < 0.0601);
    HOLDS(fmi3GetFloat64_(cloth, &position, 1, &x, 1) == fmi3OK);
    size_t size = 0;
    HOLDS(fmi3SerializedFMUStateSize_(cloth, state, &size) == fmi3OK);
    fmi3Byte *bytes = malloc(size);
    HOLDS(fmi3SerializeFMUState_(cloth, state, bytes, size) == fmi3OK);
    HOLDS(fmi3GetDirectionalDerivative_(cloth, &position, 1, &gravity, 1, &g, 1, &x, 1) == fmi3Error);
    HOLDS(lines == 1);
    HOLDS(fmi3Reset_(cloth) == fmi3OK);
    HOLDS(fmi3DeserializeFMUState_(cloth, bytes, size, &copy) == fmi3OK);
    free(bytes);
    HOLDS(fmi3SetFMUState_(cloth, copy) == fmi3OK);
    time = 0.01 + 0.01 + 0.01;
    for (int i = 3; i < 6; ++i, time += 0.01) {
        fmi3Boolean event, end, early;
        HOLDS(fmi3DoStep_(cloth, time, 0.01, fmi3True, &event, &end, &early, &reached) == fmi3OK);
    }
    HOLDS(fmi3GetFloat64_(cloth, &position, 1, &again, 1) == fmi3OK && again == x);
    HOLDS(fmi3FreeFMUState_(cloth, &copy) == fmi3OK && copy == NULL);
    /* the other state goes with its instance */
    HOLDS(fmi3Terminate_(cloth) == fmi3OK);
    fmi3FreeInstance_(cloth);
    return x;
}

static double two(const char *token, const char *resources, fmi2ValueReference position) {
    FIND(fmi2GetVersion);
    FIND(fmi2GetTypesPlatform);
    FIND(fmi2Instantiate);
    FIND(fmi2SetupExperiment);
    FIND(fmi2EnterInitializationMode);
    FIND(fmi2ExitInitializationMode);
    FIND(fmi2DoStep);
    FIND(fmi2CancelStep);
    FIND(fmi2GetReal);
    FIND(fmi2SetReal);
    FIND(fmi2GetFMUstate);
    FIND(fmi2SetFMUstate);
    FIND(fmi2FreeInstance);
    HOLDS(strcmp(fmi2GetVersion_(), fmi2Version) == 0);
    HOLDS(strcmp(fmi2GetTypesPlatform_(), fmi2TypesPlatform) == 0);
    const fmi2CallbackFunctions callbacks = {tell2, calloc, free, NULL, &lines};
    fmi2Component cloth =
        fmi2Instantiate_("cloth", fmi2CoSimulation, token, resources, &callbacks, fmi2False, fmi2False);
    HOLDS(cloth != NULL);
    const fmi2ValueReference gravity = 1;
    const fmi2Real g = 0.5;
    fmi2Real x = 0, again = 0;
    double time = 0;
    HOLDS(fmi2SetReal_(cloth, &gravity, 1, &g) == fmi2OK);
    HOLDS(fmi2SetupExperiment_(cloth, fmi2False, 0, 0, fmi2True, 1) == fmi2OK);
    HOLDS(fmi2EnterInitializationMode_(cloth) == fmi2OK);
    HOLDS(fmi2ExitInitializationMode_(cloth) == fmi2OK);
    fmi2FMUstate state = NULL;
    for (int i = 0; i < 6; ++i, time += 0.01) {
        HOLDS(fmi2DoStep_(cloth, time, 0.01, fmi2False) == fmi2OK);
        if (i == 2) HOLDS(fmi2GetFMUstate_(cloth, &state) == fmi2OK);
    }
    HOLDS(fmi2GetReal_(cloth, &position, 1, &x) == fmi2OK);
    HOLDS(fmi2CancelStep_(cloth) == fmi2Error && lines == 1);
    HOLDS(fmi2SetFMUstate_(cloth, state) == fmi2OK);
    time = 0.01 + 0.01 + 0.01;
    for (int i = 3; i < 6; ++i, time += 0.01) HOLDS(fmi2DoStep_(cloth, time, 0.01, fmi2True) == fmi2OK);
    HOLDS(fmi2GetReal_(cloth, &position, 1, &again) == fmi2OK && again == x);
    fmi2FreeInstance_(cloth);
    return x;
}

int main(int count, char **arguments) {
    HOLDS(count == 7);
    const int version = atoi(arguments[2]), cycles = atoi(arguments[6]);
    const unsigned position = (unsigned)atoi(arguments[5]);
    double first = 0;
    /* the least of a tenth of the cycles: the allocator's own remainders come and go by hundreds of bytes */
    const int window = cycles / 10;
    size_t early = SIZE_MAX, late = SIZE_MAX;
    for (int i = 0; i < cycles; ++i) {
        lines = 0;
        library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
        HOLDS(library != NULL);
        const double x = version == 3 ? three(arguments[3], arguments[4], position)
                                      : two(arguments[3], arguments[4], position);
        HOLDS(dlclose(library) == 0);
        if (i == 0) first = x;
        HOLDS(x == first);
        const size_t held = mallinfo2().uordblks;
        if (i >= window && i < 2 * window && held < early) early = held;
        if (i >= cycles - window && held < late) late = held;
    }
    printf("%a %zu %zu\n", first, early, late);
    return 0;
}
