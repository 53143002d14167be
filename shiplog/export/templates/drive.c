/* Sails a schedule that it reads: doubles in, states out. */
#include <stdio.h>
#include <stdlib.h>
#include "@FILE@"

int main(void) {
    static @NAME@_ship ship;
    static @NAME@_parameters parameters;
    @NAME@_input input;
    double head[6 + 2 + 2], count;
    long i;
    @NAME@_defaults(&parameters);
    if (fread(head, sizeof(double), 10, stdin) != 10) return 1;
    if (fread(&count, sizeof(double), 1, stdin) != 1) return 1;
    memcpy(input.wind, head + 6, sizeof input.wind);
    memcpy(input.current, head + 8, sizeof input.current);
    @NAME@_begin(&ship, &parameters, head, NULL);
    for (i = 0; i < (long)count; ++i) {
        if (fread(input.order, sizeof(double), @NAME@_ACTUATORS, stdin) != @NAME@_ACTUATORS)
            return 2;
        @NAME@_step(&ship, &parameters, &input);
        if (fwrite(ship.state, sizeof(double), 6, stdout) != 6) return 3;
    }
    return 0;
}
