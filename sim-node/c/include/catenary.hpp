// Catenary's client API for C++17: catenary.h with owners and exceptions. The functions of catenary.h
// work beside it, on Client::get().
#ifndef CATENARY_HPP
#define CATENARY_HPP

#include <optional>
#include <stdexcept>
#include <utility>

#include "catenary.h"

namespace catenary {

// A call that failed. what() is the text of catenary_last_error.
class Error : public std::runtime_error {
public:
    explicit Error(catenary_result result) : std::runtime_error(catenary_last_error()), result_(result) {}
    catenary_result result() const { return result_; }

private:
    catenary_result result_;
};

// Throws an Error for every result but CATENARY_OK.
inline void check(catenary_result result) {
    if (result != CATENARY_OK) throw Error(result);
}

// Returns false for CATENARY_TIMEOUT, and throws an Error for every other result but CATENARY_OK.
inline bool arrived(catenary_result result) {
    if (result == CATENARY_TIMEOUT) return false;
    check(result);
    return true;
}

// A borrowed snapshot, released at the end of its scope. It may outlive its client.
class Snapshot {
public:
    explicit Snapshot(catenary_snapshot held) : held_(held) {}
    Snapshot(Snapshot &&other) noexcept : held_(std::exchange(other.held_, catenary_snapshot())) {}
    Snapshot &operator=(Snapshot &&other) noexcept {
        std::swap(held_, other.held_);
        return *this;
    }
    ~Snapshot() {
        if (held_.handle != 0) catenary_release_snapshot(&held_);
    }

    const catenary_snapshot_header &header() const { return *held_.header; }
    const catenary_particle_state &operator[](size_t index) const { return held_.particles[index]; }
    const catenary_particle_state *begin() const { return held_.particles; }
    const catenary_particle_state *end() const { return held_.particles + held_.particle_count; }
    size_t size() const { return held_.particle_count; }

private:
    catenary_snapshot held_;
};

// A client, detached at the end of its scope. Calls that read return nothing after their timeout.
class Client {
public:
    // Null stands for the defaults of catenary_attach.
    explicit Client(const char *name = nullptr, const char *domain = nullptr) {
        check(catenary_attach(name, domain, &client_));
    }
    Client(Client &&other) noexcept : client_(std::exchange(other.client_, nullptr)) {}
    Client &operator=(Client &&other) noexcept {
        std::swap(client_, other.client_);
        return *this;
    }
    ~Client() {
        if (client_ != nullptr) catenary_detach(client_);
    }
    catenary_client *get() const { return client_; }

    std::optional<Snapshot> next_snapshot(double timeout_s) {
        return snapshot(catenary_next_snapshot, timeout_s);
    }
    std::optional<Snapshot> latest_snapshot(double timeout_s) {
        return snapshot(catenary_latest_snapshot, timeout_s);
    }

    // Sends a command and waits for its outcome. A rejection is an Error.
    catenary_outcome request(const catenary_command &command, double timeout_s) {
        catenary_outcome outcome;
        check(catenary_request(client_, command, timeout_s, &outcome));
        return outcome;
    }
    void send(const catenary_command &command) { check(catenary_send(client_, command, nullptr)); }
    // An outcome may be a rejection.
    std::optional<catenary_outcome> next_outcome(double timeout_s) {
        catenary_outcome outcome;
        if (!arrived(catenary_next_outcome(client_, timeout_s, &outcome))) return std::nullopt;
        return outcome;
    }

    void join_lockstep(uint32_t every, double timeout_s) {
        check(catenary_join_lockstep(client_, every, timeout_s));
    }
    std::optional<Snapshot> next_turn(double timeout_s) {
        return snapshot(catenary_next_turn, timeout_s);
    }
    void ready() { check(catenary_ready(client_)); }
    uint64_t missed_turns() {
        uint64_t count;
        check(catenary_missed_turns(client_, &count));
        return count;
    }

private:
    template <typename Function> std::optional<Snapshot> snapshot(Function function, double timeout_s) {
        catenary_snapshot held;
        if (!arrived(function(client_, timeout_s, &held))) return std::nullopt;
        return Snapshot(held);
    }

    catenary_client *client_ = nullptr;
};

}  // namespace catenary

#endif  // CATENARY_HPP
