/* What a C client takes for the same writes: link_client PORT ROUNDS < writes
 *
 * Standard input has a line a write: "6 ADDRESS VALUE" or "16 ADDRESS COUNT VALUE...". Prints microseconds, a line a round,
 * and last the number of the processor that it ran on.
 */
#define _GNU_SOURCE
#include <modbus.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { MOST_WRITES = 4096, MOST_REGISTERS = 123 };

typedef struct {
    int function_code, address, count;
    uint16_t registers[MOST_REGISTERS];
} write_t;

static write_t writes[MOST_WRITES];

static int read_writes(void) {
    int length = 0, value;
    while (length < MOST_WRITES && scanf("%d %d", &writes[length].function_code, &writes[length].address) == 2) {
        write_t *one = &writes[length++];
        one->count = 1;
        if (one->function_code == 16 && scanf("%d", &one->count) != 1)
            return -1;
        for (int i = 0; i < one->count; i++) {
            if (scanf("%d", &value) != 1)
                return -1;
            one->registers[i] = (uint16_t)value;
        }
    }
    return length;
}

static int write_one(modbus_t *modbus, const write_t *one) {
    if (one->function_code == 6)
        return modbus_write_register(modbus, one->address, one->registers[0]);
    return modbus_write_registers(modbus, one->address, one->count, one->registers);
}

int main(int count, char **words) {
    struct timespec begun, ended;
    int length = read_writes();
    modbus_t *modbus = count == 3 ? modbus_new_tcp("127.0.0.1", atoi(words[1])) : NULL;
    if (length <= 0 || modbus == NULL || modbus_set_slave(modbus, 1) == -1 || modbus_connect(modbus) == -1)
        return 1;
    for (int round = 0; round < atoi(words[2]); round++) {
        clock_gettime(CLOCK_MONOTONIC, &begun);
        for (int i = 0; i < length; i++)
            if (write_one(modbus, &writes[i]) == -1)
                return 1;
        clock_gettime(CLOCK_MONOTONIC, &ended);
        printf("%.1f\n", (ended.tv_sec - begun.tv_sec) * 1e6 + (ended.tv_nsec - begun.tv_nsec) / 1e3);
    }
    printf("%d\n", sched_getcpu());
    return 0;
}
