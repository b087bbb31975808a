/* A Modbus server on libmodbus: registers and nothing else, for tests of the client.
 *
 *   libmodbus_server tcp PORT REGISTERS              PORT 0 takes a free one
 *   libmodbus_server rtu DEVICE REGISTERS BAUDRATE PARITY STOP_BITS
 *
 * It holds registers 0 to REGISTERS - 1, answers all else with exception 2, and says "ready PORT" when it listens.
 * In its environment: MOST_REGISTERS of one request (more: exception 3), WITHOUT_FC6 (exception 1), ANSWER_AS, the unit
 * of all its replies.
 */
#include <errno.h>
#include <modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DEVICE_ID = 1, BACKLOG = 8 };

static int fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    return 1;
}

static int port_of(int listener) {
    struct sockaddr_in address;
    socklen_t length = sizeof address;
    if (getsockname(listener, (struct sockaddr *)&address, &length) == -1)
        return -1;
    return ntohs(address.sin_port);
}

static void ready(int port) {
    printf("ready %d\n", port);
    fflush(stdout);
}

static void answer(modbus_t *modbus, uint8_t *request, int length, modbus_mapping_t *registers) {
    const char *most = getenv("MOST_REGISTERS"), *unit = getenv("ANSWER_AS");
    uint8_t *pdu = request + modbus_get_header_length(modbus);
    int count = pdu[3] << 8 | pdu[4], many = pdu[0] == 3 || pdu[0] == 16;
    if (unit)
        pdu[-1] = atoi(unit);
    if (pdu[0] == 6 && getenv("WITHOUT_FC6"))
        modbus_reply_exception(modbus, request, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
    else if (many && most && count > atoi(most))
        modbus_reply_exception(modbus, request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
    else
        modbus_reply(modbus, request, length, registers);
}

static int serve_line(modbus_t *modbus, modbus_mapping_t *registers) {
    uint8_t request[MODBUS_RTU_MAX_ADU_LENGTH];
    if (modbus_set_slave(modbus, DEVICE_ID) == -1 || modbus_connect(modbus) == -1)
        return fail("connect");
    ready(0);
    for (;;) {
        int length = modbus_receive(modbus, request);
        if (length > 0)
            answer(modbus, request, length, registers);
        else if (length == -1 && (errno == EIO || errno == EBADF))
            return fail("line"); /* the pseudo-terminal has gone */
    }
}

static int serve_network(modbus_t *modbus, modbus_mapping_t *registers) {
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    int on = 1, listener = modbus_tcp_listen(modbus, BACKLOG), highest = listener;
    fd_set open_ones, waiting;
    if (listener == -1)
        return fail("listen");
    FD_ZERO(&open_ones);
    FD_SET(listener, &open_ones);
    ready(port_of(listener));
    for (;;) {
        waiting = open_ones;
        if (select(highest + 1, &waiting, NULL, NULL, NULL) == -1)
            return fail("select");
        for (int socket = 0; socket <= highest; socket++) {
            if (!FD_ISSET(socket, &waiting))
                continue;
            if (socket == listener) {
                int client = accept(listener, NULL, NULL);
                if (client == -1)
                    continue;
                setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
                FD_SET(client, &open_ones);
                highest = client > highest ? client : highest;
                continue;
            }
            modbus_set_socket(modbus, socket);
            int length = modbus_receive(modbus, request);
            if (length > 0)
                answer(modbus, request, length, registers);
            else if (length == -1) {
                close(socket);
                FD_CLR(socket, &open_ones);
            }
        }
    }
}

int main(int count, char **words) {
    int line = count == 7 && strcmp(words[1], "rtu") == 0;
    if (!line && !(count == 4 && strcmp(words[1], "tcp") == 0)) {
        fprintf(stderr, "usage: %s tcp PORT REGISTERS | rtu DEVICE REGISTERS BAUDRATE PARITY STOP_BITS\n", words[0]);
        return 2;
    }
    modbus_mapping_t *registers = modbus_mapping_new(0, 0, atoi(words[3]), 0);
    modbus_t *modbus = line ? modbus_new_rtu(words[2], atoi(words[4]), words[5][0], 8, atoi(words[6]))
                            : modbus_new_tcp("127.0.0.1", atoi(words[2]));
    if (registers == NULL || modbus == NULL)
        return fail("new");
    return line ? serve_line(modbus, registers) : serve_network(modbus, registers);
}
