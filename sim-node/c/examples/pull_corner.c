// Pulls the last particle of the scene, which is a corner of the curtain, and prints its height while it
// rises, and after the release: pull_corner [SECONDS]
#include <stdio.h>
#include <stdlib.h>

#include "catenary.h"

// Ends the program with the text of a failed call.
static void check(catenary_result result) {
    if (result == CATENARY_OK) return;
    fprintf(stderr, "error: %s\n", catenary_last_error());
    exit(1);
}

// Prints the height of a particle from a step on, every 60 steps, for a number of steps.
static void print_heights(catenary_client *client, uint32_t particle, uint64_t first, int count) {
    for (uint64_t due = first; due < first + count;) {
        catenary_snapshot snapshot;
        check(catenary_next_snapshot(client, 1.0, &snapshot));
        const uint64_t step = snapshot.header->step;
        if (step >= due) {
            const float height = snapshot.particles[particle].position[1];
            printf("step %llu: %.3f m\n", (unsigned long long)step, height);
            due += 60;
        }
        check(catenary_release_snapshot(&snapshot));
    }
}

int main(int argc, char **argv) {
    const double seconds = argc > 1 ? atof(argv[1]) : 1.0;
    catenary_client *client;
    check(catenary_attach(NULL, NULL, &client));  // "sim", in the domain of CATENARY_DOMAIN

    catenary_snapshot snapshot;
    check(catenary_latest_snapshot(client, 1.0, &snapshot));
    const uint32_t corner = (uint32_t)snapshot.particle_count - 1;
    const float *at = snapshot.particles[corner].position;
    const float target[3] = {at[0], at[1] + 0.3f, at[2] + 0.2f};
    check(catenary_release_snapshot(&snapshot));

    catenary_topology topology;
    check(catenary_read_topology(client, 1.0, &topology));
    const int count = (int)(seconds * topology.header.rate_hz);

    // CATENARY_OK means that the command took effect. A rejection is a result of its own.
    catenary_outcome outcome;
    check(catenary_request(client, catenary_command_grab(corner, target, 0.25f), 1.0, &outcome));
    printf("particle %u is grabbed from step %llu\n", corner, (unsigned long long)outcome.step);
    print_heights(client, corner, outcome.step, count);
    check(catenary_request(client, catenary_command_release(corner), 1.0, &outcome));
    puts("released");
    print_heights(client, corner, outcome.step, count);
    check(catenary_detach(client));
    return 0;
}
