// Brings the pendulum to rest, as a member of the lockstep: `sim-node run pendulum`, then hold [STEPS]
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "catenary.hpp"

const double TIMEOUT_S = 5;
// Displacement of the pivot against the mass, per speed of the mass, in seconds.
const float GAIN = 0.25f;
// Time in which the pivot follows, in seconds: an immediate move would jerk the mass.
const float OVER_S = 0.25f;

// Returns the speed of the mass at the end.
float hold(catenary::Client &client, long steps) {
    client.join_lockstep(1, TIMEOUT_S);
    std::optional<catenary_particle_state> rest;
    float speed = 0;
    for (long step = 0; step < steps; step++) {
        auto snapshot = client.next_turn(TIMEOUT_S);
        if (!snapshot) throw std::runtime_error("the node is paused");
        if (snapshot->size() != 2) throw std::runtime_error("not a pendulum");
        const auto &pivot = (*snapshot)[0];
        const auto &mass = (*snapshot)[1];
        if (!rest) rest = pivot;
        // The pivot gives way against the motion of the mass, as a viscous fluid would.
        const float target[3] = {rest->position[0] - GAIN * mass.velocity[0], rest->position[1],
                                 rest->position[2] - GAIN * mass.velocity[2]};
        const bool is_grabbed = pivot.flags & CATENARY_PARTICLE_GRABBED;
        client.send(is_grabbed ? catenary_command_move(0, target, OVER_S)
                               : catenary_command_grab(0, target, OVER_S));
        speed = std::hypot(mass.velocity[0], mass.velocity[1], mass.velocity[2]);
        client.ready();
        // The outcomes of the command before.
        while (auto outcome = client.next_outcome(0)) {
            if (outcome->status != CATENARY_OUTCOME_STATUS_APPLIED)
                throw std::runtime_error(catenary_reason_name(outcome->reason));
        }
    }
    return speed;
}

int main(int argc, char **argv) try {
    catenary::Client client;
    std::printf("the mass moves at %.6f m/s\n", hold(client, argc > 1 ? std::atol(argv[1]) : 2400));
    return 0;
} catch (const std::exception &error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
}
