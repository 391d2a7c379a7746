// Catenary's client API: reads the states of a running simulation in shared memory, and commands it.
//
// - Results: every function that can fail returns a catenary_result, and catenary_last_error describes
//   the failure. No call aborts the program, and a null, released or wrong handle is CATENARY_MISUSE.
// - Ownership: release every snapshot, and detach every client before the process ends. Lists and texts
//   belong to the client, and are valid until its next call of the same function.
// - Threads: a client is for one thread at a time. Functions without a client are for any thread.
// - Timeouts are in seconds, finite, 0 or more; 0 polls. Calls wait at most that long, so a program that
//   handles SIGINT itself looks at its flag between calls. The library installs no signal handler.
// - Lengths are in the unit of the scene (m), relative to its origin; times in s; velocities in m/s.
//
// Generated from the Rust types of the crate sim-c; do not edit.


#ifndef CATENARY_H
#define CATENARY_H

#include <stddef.h>
#include <stdint.h>
#define CATENARY_CONTRACT_VERSION 7  // version of the layouts of this header
#define CATENARY_MEMBERS_MAX 16  // most members of the lockstep
#define CATENARY_MEMBER_CHANGES_KEPT 32  // changes that a status names
#define CATENARY_FIELDS_SIZE_BYTES 232  // bytes of the fields of a command
#define CATENARY_TEXT_SIZE_BYTES_MAX 160  // longest text of a command
#define CATENARY_PARTICLE_PINNED 1  // held in place
#define CATENARY_PARTICLE_GRABBED 2  // driven by a client
#define CATENARY_PARTICLE_ANCHORED 4  // moved by an anchor
#define CATENARY_PARTICLE_FROZEN 8  // excluded: its state was not finite
#define CATENARY_SNAPSHOT_PAUSED 1  // the node was paused in this step
#define CATENARY_SNAPSHOT_REPLAY 2  // the writer plays a recording
#define CATENARY_SNAPSHOT_IN_PLACE 4  // a command has put the state in place
#define CATENARY_STATUS_PAUSED 1  // the node waits for resume or step
#define CATENARY_STATUS_REPLAY 2  // the writer plays a recording
#define CATENARY_STATUS_AT_END 4  // the recording has ended
#define CATENARY_OUTCOME_CONTROL 1  // answers a command to a replay
#define CATENARY_OUTCOME_DISCONNECTED 2  // release of a lost grab
#define CATENARY_OUTCOME_NEW_RUN 4  // the scene begins a new run at step 0


// Result of a call. `catenary_last_error` describes every other result than `CATENARY_OK`.
typedef enum {
  // The call has done its work.
  CATENARY_OK = 0,
  // The node rejected the command. The outcome has the reason; no bit of the state changed.
  CATENARY_REJECTED = 1,
  // Nothing arrived within the timeout. The node may be paused.
  CATENARY_TIMEOUT = 2,
  // The node has ended. The client goes on with the next node of the same name.
  CATENARY_GONE = 3,
  // No node runs under this name in this domain.
  CATENARY_NO_NODE = 4,
  // The command was sent, but its outcome did not arrive in time, so its effect is unknown.
  CATENARY_UNANSWERED = 5,
  // The command was not sent: no node receives commands, or too many of this client are waiting.
  CATENARY_NOT_SENT = 6,
  // A mistake of the program: a null or released handle, a wrong argument, or a call out of order.
  CATENARY_MISUSE = 7,
  // A service or its shared memory failed.
  CATENARY_FAILED = 8,
  // A fault of this library. Detach the client.
  CATENARY_BUG = 9,
} catenary_result;

// Recipient of an impulse.
enum catenary_force_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // A collider.
  CATENARY_FORCE_KIND_COLLIDER = 0,
  // An anchor.
  CATENARY_FORCE_KIND_ANCHOR = 1,
  // A pinned, grabbed or anchored particle.
  CATENARY_FORCE_KIND_PARTICLE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_force_kind catenary_force_kind;
#else
typedef uint32_t catenary_force_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a change of the members, with the reason why a member was removed.
enum catenary_member_change_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It has joined.
  CATENARY_MEMBER_CHANGE_KIND_JOINED = 0,
  // It has closed its connection. So has a killed one, if another process cleaned up after it before the
  // node looked.
  CATENARY_MEMBER_CHANGE_KIND_LEFT = 1,
  // Its process ended without closing the connection.
  CATENARY_MEMBER_CHANGE_KIND_KILLED = 2,
  // It was not ready within the longest wait of the node.
  CATENARY_MEMBER_CHANGE_KIND_TIMED_OUT = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_member_change_kind catenary_member_change_kind;
#else
typedef uint32_t catenary_member_change_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Effect of a command.
enum catenary_outcome_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It took effect, in the step that the outcome names.
  CATENARY_OUTCOME_STATUS_APPLIED = 0,
  // It changed no bit of the state.
  CATENARY_OUTCOME_STATUS_REJECTED = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_outcome_status catenary_outcome_status;
#else
typedef uint32_t catenary_outcome_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Reason why a command was rejected. A rejected command changes no bit of the state.
enum catenary_reason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // A number is NaN or infinite.
  CATENARY_REASON_NON_FINITE = 1,
  // A coordinate exceeds 1e7, or a value lies outside its range.
  CATENARY_REASON_OUT_OF_RANGE = 2,
  // The scene has no such particle.
  CATENARY_REASON_UNKNOWN_PARTICLE = 3,
  // The scene has no such constraint.
  CATENARY_REASON_UNKNOWN_CONSTRAINT = 4,
  // The scene has no such anchor.
  CATENARY_REASON_UNKNOWN_ANCHOR = 5,
  // The scene has no such collider.
  CATENARY_REASON_UNKNOWN_COLLIDER = 6,
  // There is no such parameter.
  CATENARY_REASON_UNKNOWN_PARAMETER = 7,
  // The constraint is already torn.
  CATENARY_REASON_ALREADY_TORN = 8,
  // The particle is not grabbed.
  CATENARY_REASON_NOT_GRABBED = 9,
  // Another client has grabbed the particle.
  CATENARY_REASON_GRABBED_BY_OTHER = 10,
  // The command has no effect here: the particle is frozen, the parameter belongs to the other
  // method, `step` came while the node was running, or a recording is being played.
  CATENARY_REASON_NO_EFFECT_HERE = 11,
  // No state at or before that step is kept.
  CATENARY_REASON_UNKNOWN_STEP = 12,
  // A given state is damaged, or does not belong to the scene.
  CATENARY_REASON_INVALID_STATE = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_reason catenary_reason;
#else
typedef uint32_t catenary_reason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The role of a constraint in its scene.
enum catenary_constraint_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Joins direct neighbours.
  CATENARY_CONSTRAINT_KIND_STRUCTURAL = 0,
  // Crosses a cell diagonally.
  CATENARY_CONSTRAINT_KIND_SHEAR = 1,
  // Joins second neighbours.
  CATENARY_CONSTRAINT_KIND_BEND = 2,
  // Acts only while it is longer than its rest length.
  CATENARY_CONSTRAINT_KIND_TETHER = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_constraint_kind catenary_constraint_kind;
#else
typedef uint32_t catenary_constraint_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Shape of a collider.
enum catenary_collider_shape
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // A solid half space.
  CATENARY_COLLIDER_SHAPE_PLANE = 0,
  // A solid box.
  CATENARY_COLLIDER_SHAPE_BOX = 1,
  // A solid sphere.
  CATENARY_COLLIDER_SHAPE_SPHERE = 2,
  // All points within a radius of a segment.
  CATENARY_COLLIDER_SHAPE_CAPSULE = 3,
  // A box that particles stay inside.
  CATENARY_COLLIDER_SHAPE_BOUNDS = 4,
  // Triangles with two sides.
  CATENARY_COLLIDER_SHAPE_MESH = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_collider_shape catenary_collider_shape;
#else
typedef uint32_t catenary_collider_shape;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Cause of a tear.
enum catenary_tear_cause
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The constraint's force exceeded `tear_force`.
  CATENARY_TEAR_CAUSE_FORCE = 0,
  // The constraint's length exceeded `tear_stretch` times its rest length.
  CATENARY_TEAR_CAUSE_STRETCH = 1,
  // The constraint's length exceeded its rest length by more than `tear_distance`.
  CATENARY_TEAR_CAUSE_DISTANCE = 2,
  // A command cut the constraint.
  CATENARY_TEAR_CAUSE_CUT = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_tear_cause catenary_tear_cause;
#else
typedef uint32_t catenary_tear_cause;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Method of solving constraints. It determines the meaning of a constraint's softness.
enum catenary_method
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // XPBD, with compliance in m/N: the stretch is the same at every rate (Macklin, Mueller, Chentanez
  // 2016).
  CATENARY_METHOD_XPBD = 0,
  // PBD, with stiffness 0..=1: the share of the error that the iterations of a substep remove
  // (Mueller et al. 2007).
  CATENARY_METHOD_PBD = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_method catenary_method;
#else
typedef uint32_t catenary_method;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A parameter that can change while a scene runs. Its number is its index in `PARAMETERS`, which describes it.
enum catenary_parameter
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  CATENARY_PARAMETER_GRAVITY = 0,
  CATENARY_PARAMETER_DAMPING = 1,
  CATENARY_PARAMETER_WIND_VELOCITY = 2,
  CATENARY_PARAMETER_WIND_DRAG = 3,
  CATENARY_PARAMETER_SUBSTEPS = 4,
  CATENARY_PARAMETER_ITERATIONS = 5,
  CATENARY_PARAMETER_RELAXATION = 6,
  CATENARY_PARAMETER_MAX_STRETCH = 7,
  CATENARY_PARAMETER_TEAR_STRETCH = 8,
  CATENARY_PARAMETER_TEAR_DISTANCE = 9,
  CATENARY_PARAMETER_TEAR_FORCE = 10,
  CATENARY_PARAMETER_MAX_SPEED = 11,
  CATENARY_PARAMETER_TIME_SCALE = 12,
  CATENARY_PARAMETER_COMPLIANCE = 13,
  CATENARY_PARAMETER_STIFFNESS = 14,
  CATENARY_PARAMETER_CONTACT_THICKNESS = 15,
  CATENARY_PARAMETER_CONTACT_FRICTION = 16,
  CATENARY_PARAMETER_BENDING = 17,
  CATENARY_PARAMETER_FRICTION = 18,
  CATENARY_PARAMETER_RESTITUTION = 19,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_parameter catenary_parameter;
#else
typedef uint32_t catenary_parameter;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Object that a command `follow` moves.
enum catenary_moved_object
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // A particle that the client has grabbed.
  CATENARY_MOVED_OBJECT_PARTICLE = 0,
  // An anchor.
  CATENARY_MOVED_OBJECT_ANCHOR = 1,
  // A collider.
  CATENARY_MOVED_OBJECT_COLLIDER = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum catenary_moved_object catenary_moved_object;
#else
typedef uint32_t catenary_moved_object;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A connection to a simulation. It reads snapshots and sends commands.
//
// A client may be used by any thread, but by one at a time: a call while another thread is in a call
// of the same client returns `CATENARY_MISUSE`. Threads that work at the same time attach one client
// each. A client does not survive `fork`.
typedef struct catenary_client catenary_client;

// A command: 256 bytes, alignment 8. Written by clients, read by the owner of the name; also part
// of an `catenary_outcome`.
typedef struct {
  // Number of the kind of command.
  uint32_t kind;
  // Always 0.
  uint32_t spare;
  // Random number of the sender, below 2^53 (exact in JSON); `CONSOLE_CLIENT_ID` is the console.
  uint64_t client_id;
  // Number of the command among those of its client, ascending, below 2^53.
  uint64_t sequence;
  // Fields of the kind, one after the other, without gaps; then zeros.
  uint8_t fields[232];
} catenary_command;

// Header of `forces`: 24 bytes, alignment 8. The payload has a row for each collider, then for each anchor,
// then for each pinned, grabbed or anchored particle, each by index.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // Step in which the impulses acted.
  uint64_t step;
  // Length of the payload.
  uint32_t count;
  // Steps per second: a force is an impulse times this rate.
  uint32_t rate_hz;
} catenary_forces_header;

// The impulse of a step on a collider, an anchor or a particle: 40 bytes, alignment 4; an element of `forces`.
typedef struct {
  // A `catenary_force_kind` as a number.
  uint32_t kind;
  // Index of the collider, anchor or particle.
  uint32_t index;
  // On a collider, that of the particles in contact with it; on a particle, that of its constraints, bends
  // and tethers; on an anchor, the sum of those of its particles. In N s.
  float impulse[3];
  // About the center of the collider or anchor, in N m s. 0 for a particle.
  float angular_impulse[3];
  // Largest number of particles in contact with the collider in one substep; else 0.
  uint32_t contacts;
  // Always 0.
  uint32_t spare;
} catenary_force_row;

// The impulses of a step, borrowed from the client. A force in N is `impulse` times `header.rate_hz`, and a
// torque in N m is `angular_impulse` times it.
typedef struct {
  // Header of the rows: the step, and its rate.
  catenary_forces_header header;
  // The rows: of each collider, then of each anchor, then of each pinned, grabbed or anchored particle, each
  // by index. The row of a collider is the one at its index.
  const catenary_force_row *rows;
  // Number of rows.
  size_t row_count;
} catenary_forces;

// Header of `particles`: 112 bytes, alignment 8. Written by the node or a replay. The snapshot and
// the keyframe of a step are together the complete state of the solver after that step.
typedef struct {
  // `CATENARY_CONTRACT_VERSION` of the writer.
  uint32_t contract_version;
  // Version of the solver's arithmetic. It changes with any change of the bits of a state.
  uint32_t solver_version;
  // Random number of this run of the node, or of this pass of a replay.
  uint64_t run_id;
  // Number of the step whose end this state is; 0 is the scene as loaded. Within a run it never
  // goes back and skips no step, although a reader may miss snapshots.
  uint64_t step;
  // Steps since the scene was last loaded, reset or restored.
  uint64_t scene_step;
  // Step of the newest published keyframe.
  uint64_t keyframe_step;
  // step / rate in nanoseconds, rounded down.
  uint64_t sim_time_ns;
  // Time of publication: CLOCK_MONOTONIC in nanoseconds.
  uint64_t publish_monotonic_ns;
  // XXH3-64 of the payload. The seed is 0 while nothing is torn, else the XXH3-64 of the torn
  // constraints' indices, ascending, as little-endian u32.
  uint64_t state_hash;
  // Number of outcomes in this run so far. Outcomes with a lower index are part of this state.
  uint64_t outcome_count;
  // Delay of the step's start after its deadline, in nanoseconds.
  uint64_t wake_late_ns;
  // Time that the solver took for this step, in nanoseconds.
  uint64_t solve_ns;
  // Number of the load in this run. Topology, surface and scene of the load carry the same number.
  uint32_t topology_revision;
  // Number of torn constraints.
  uint32_t torn_count;
  // Length of the payload.
  uint32_t particle_count;
  // `SnapshotFlags` bits.
  uint32_t flags;
  // Number of steps from one published snapshot to the next: 1, unless the node runs with
  // `--every`. A node that pauses also publishes the step before the pause. In a replay, the distance
  // from the snapshot before.
  uint32_t stride;
  // Number of snapshots that the run has published before this one, modulo 2^32. A reader that finds
  // a number left out has missed that snapshot, whatever the steps between them.
  uint32_t snapshot_index;
} catenary_snapshot_header;

// Header of `topology`, `bends`, `surface` and `scene`: 72 bytes, alignment 8. Written once per load.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // First step that shows this load.
  uint64_t step;
  // Hash of the scene's text; see `scene_hash`. Set by the owner.
  uint64_t scene_hash;
  // Origin of all positions, in the scene's unit (m).
  double origin[3];
  // Same as in `catenary_snapshot_header`.
  uint32_t topology_revision;
  // Length of the payload in constraints, bends, triangles or bytes.
  uint32_t count;
  // Number of particles in the scene.
  uint32_t particle_count;
  // Steps per second.
  uint32_t rate_hz;
  // A `catenary_method` as a number.
  uint32_t method;
  // Always 0.
  uint32_t spare;
} catenary_load_header;

// A constraint: 20 bytes, alignment 4. Its position in `topology` is its index everywhere. It does
// not change until the next load; the service `tears` lists the torn constraints.
typedef struct {
  // Index of the first particle.
  uint32_t a;
  // Index of the second particle.
  uint32_t b;
  // Rest length in m.
  float rest_length;
  // Compliance in m/N (method xpbd) or stiffness 0..=1 (method pbd).
  float compliance;
  // A `catenary_constraint_kind` as a number.
  uint32_t kind;
} catenary_constraint_state;

// The constraints of a load, borrowed from the client.
typedef struct {
  // Header of the load. Snapshots with the same `run_id` and `topology_revision` belong to it.
  catenary_load_header header;
  // The constraints, by index.
  const catenary_constraint_state *constraints;
  // Number of constraints.
  size_t constraint_count;
} catenary_topology;

// A bend: 52 bytes, alignment 4; an element of `bends`. Its position there is its index. It does not
// change until the next load, and never tears; it stops acting once a constraint of its path is torn.
//
// With C the sum of c x over its particles, its energy in J is |C - rest n|^2 / (2 alpha), where
// alpha = `geometry` / rigidity is its compliance in m/N. For the positions p0 to p3 of a hinge, n is the unit
// vector along the sum of the unit normals of its triangles, along (p2 - p1) x (p0 - p1) and
// (p3 - p1) x (p2 - p1). `set bending` replaces the rigidity.
typedef struct {
  // Indices of the particles. The fourth of a bend of three is its second one again.
  uint32_t particles[4];
  // Coefficients c of the particles; their sum is 0. The fourth of a bend of three is 0.
  float coefficients[4];
  // Compliance times rigidity: m^2 on a surface, m^3 on a line.
  float geometry;
  // Bending rigidity of the scene: N m on a surface, N m^2 on a line.
  float rigidity;
  // C along n at rest, in m. Other than 0 only for a hinge that is folded at rest.
  float rest;
  // 0 three particles on a line, 1 the corners of a cell, which it keeps from twisting, 2 a hinge: a third
  // corner, the ends of the edge, and the other third corner of two triangles.
  uint32_t shape;
  // Index of the `[[generate]]` block that it comes from; -1 for an explicit bend, because 0 is a block.
  int32_t block;
} catenary_bend_state;

// The bends of a load, borrowed from the client. A scene without bends has none.
typedef struct {
  // Header of the load.
  catenary_load_header header;
  // The bends, by index.
  const catenary_bend_state *bends;
  // Number of bends.
  size_t bend_count;
} catenary_bends;

// A triangle of the surface: 12 bytes, alignment 4; an element of `surface`.
typedef struct {
  // Particle indices of the corners, counter-clockwise as seen from the front.
  uint32_t corners[3];
} catenary_triangle;

// The triangles of a load, borrowed from the client. A scene without a surface has none.
typedef struct {
  // Header of the load.
  catenary_load_header header;
  // The triangles.
  const catenary_triangle *triangles;
  // Number of triangles.
  size_t triangle_count;
} catenary_surface;

// Header of `tears`: 32 bytes, alignment 8. The payload lists every torn constraint,
// in the order of tearing. A list repeats the lists before it, so a reader that
// misses a message loses nothing.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // Step of the newest tear, or of the load, reset, rewind or restore that replaced the list.
  uint64_t step;
  // Step of the load, reset, rewind or restore that the list begins with. Lists with the same `since_step`
  // continue each other.
  uint64_t since_step;
  // Number of constraints at the end of the payload that tore in this step.
  uint32_t new_count;
  // Length of the payload.
  uint32_t count;
} catenary_tears_header;

// A torn constraint: 8 bytes, alignment 4; an element of `tears`.
typedef struct {
  // Index of the constraint.
  uint32_t constraint;
  // A `catenary_tear_cause` as a number; `UINT32_MAX` where the cause is unknown, as in the replay of an
  // old recording.
  uint32_t cause;
} catenary_torn_constraint;

// All torn constraints, borrowed from the client.
typedef struct {
  // Header of the list.
  catenary_tears_header header;
  // The torn constraints, in the order of tearing.
  const catenary_torn_constraint *constraints;
  // Number of torn constraints.
  size_t constraint_count;
} catenary_torn;

// Header of `parameters`: 24 bytes, alignment 8. The payload holds the values of all parameters.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // First step that these values apply to.
  uint64_t step;
  // Length of the payload.
  uint32_t count;
  // Always 0.
  uint32_t spare;
} catenary_parameters_header;

// The value of one parameter: 28 bytes, alignment 4; an element of `parameters`. A parameter with a
// value for each kind of constraint has one element for each kind. `bending` has one element for all bends,
// and after all parameters one for each generated block with a value of its own.
typedef struct {
  // A `catenary_parameter` as a number.
  uint32_t parameter;
  // A `catenary_constraint_kind` as a number, for a parameter with a value for each kind; else 0.
  uint32_t constraint_kind;
  // Index of a generated block, for its `bending`; else -1, because 0 is a block.
  int32_t block;
  // Form of the value: 0 is off, 1 a number, 2 three numbers.
  uint32_t form;
  // The number, or the three numbers. Unused components are 0.
  float value[3];
} catenary_parameter_state;

// The values of all parameters, borrowed from the client.
typedef struct {
  // Header of the values.
  catenary_parameters_header header;
  // The values. `catenary_parameter_name` returns the name of each.
  const catenary_parameter_state *values;
  // Number of values.
  size_t value_count;
} catenary_parameters;

// Header of `colliders`: 24 bytes, alignment 8. Written per load, on a change, and each step while
// a collider moves.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // Step at whose end the colliders had these poses.
  uint64_t step;
  // Length of the payload.
  uint32_t count;
  // Number of lists that the run has published before this one, modulo 2^32. A reader that finds a
  // number left out has missed that list.
  uint32_t list_index;
} catenary_colliders_header;

// A collider in its pose at the end of a step: 120 bytes, alignment 4. Its position in `colliders`
// is its index everywhere. Fields that a shape does not use are 0. Lengths are in m, relative to
// the scene's origin; velocities are in m/s.
typedef struct {
  // A `catenary_collider_shape` as a number.
  uint32_t shape;
  // Ratio of the rebound speed to the approach speed, 0..=1.
  float restitution;
  // Coefficient of friction.
  float friction;
  // Radius of a sphere or capsule; distance that particles keep from a mesh.
  float radius;
  // Offset of a plane: the side where `normal` · x >= `offset` is free.
  float offset;
  // Unit normal of a plane; points to the free side.
  float normal[3];
  // Center of a box, sphere or mesh.
  float center[3];
  // Half the edge lengths of a box, along its own axes.
  float half_extents[3];
  // Rotation of a box or mesh, as the quaternion x, y, z, w.
  float rotation[4];
  // First end of a capsule's axis; the lowest corner of bounds.
  float a[3];
  // Second end of a capsule's axis; the highest corner of bounds.
  float b[3];
  // Velocity of the collider.
  float velocity[3];
  // Angular velocity of a box or mesh about its center, in rad/s.
  float angular_velocity[3];
} catenary_collider_state;

// The colliders in their newest poses, borrowed from the client.
typedef struct {
  // Header of the list.
  catenary_colliders_header header;
  // The colliders, by index.
  const catenary_collider_state *colliders;
  // Number of colliders.
  size_t collider_count;
} catenary_colliders;

// A member of the lockstep: 24 bytes, alignment 8.
typedef struct {
  // Client id of the member.
  uint64_t client_id;
  // Last step that the member was ready for; the step of its joining if there is none.
  uint64_t step;
  // Distance of the member's turns, in steps: a turn is at the first published step that is this distance or more
  // after the last turn.
  uint32_t every;
  // 1 if the node waits for this member, otherwise 0.
  uint32_t is_awaited;
} catenary_member_status;

// A change of the members of the lockstep: 24 bytes, alignment 8.
typedef struct {
  // Client id of the member.
  uint64_t client_id;
  // Last step that was computed before the change.
  uint64_t step;
  // Distance of the member's turns, in steps, as in `catenary_member_status`.
  uint32_t every;
  // A `catenary_member_change_kind` as a number.
  uint32_t kind;
} catenary_member_change;

// The changes of the members of the lockstep in a run: 776 bytes, alignment 8. It holds the last
// `CATENARY_MEMBER_CHANGES_KEPT` of them, so that a reader that misses statuses still receives every change, or
// knows how many it has missed.
typedef struct {
  // Number of changes since the start of the run.
  uint64_t count;
  // The last changes: the one with number `n`, from 0, is entry `n` modulo `CATENARY_MEMBER_CHANGES_KEPT`.
  catenary_member_change last[CATENARY_MEMBER_CHANGES_KEPT];
} catenary_member_changes;

// Status of a node or replay: 1376 bytes, alignment 8. Written by the owner of the name at 10 Hz, and at
// once after a change of the members, before the step that follows it. Percentiles cover the steps of the last second.
typedef struct {
  // `CATENARY_CONTRACT_VERSION` of the writer.
  uint32_t contract_version;
  // Same as in `catenary_snapshot_header`.
  uint32_t solver_version;
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // Last performed step.
  uint64_t step;
  // Simulated time per wall-clock time over the last second; 0 while paused.
  double real_time_factor;
  // Requested pace: simulated time per wall-clock time; 1 is real time.
  double time_scale;
  // Delay of wake-ups after their deadlines, median, in nanoseconds.
  uint64_t wake_late_ns_p50;
  // Delay of wake-ups after their deadlines, 99th percentile, in nanoseconds.
  uint64_t wake_late_ns_p99;
  // Time of the solver for a step, median, in nanoseconds.
  uint64_t solve_ns_p50;
  // Time of the solver for a step, 99th percentile, in nanoseconds.
  uint64_t solve_ns_p99;
  // Number of steps of this run that began more than a period after their deadline.
  uint64_t late_steps;
  // Number of periods of this run that the node skipped because it was too far behind.
  uint64_t skipped_periods;
  // Number of outcomes of this run.
  uint64_t outcome_count;
  // Number of rejected commands of this run, and of refused messages of the service `ready`.
  uint64_t rejected_count;
  // Number of frozen particles, whose state was not finite.
  uint64_t frozen_count;
  // Number of steps in which a body stood, because no `drive_body` came for it after the first; of the scene since
  // its load.
  uint64_t standing_body_steps;
  // Steps per second.
  uint32_t rate_hz;
  // Number of particles in the scene.
  uint32_t particle_count;
  // Number of constraints in the scene.
  uint32_t constraint_count;
  // Number of torn constraints.
  uint32_t torn_count;
  // Number of readers of `particles`.
  uint32_t reader_count;
  // Process id of the writer.
  uint32_t process_id;
  // `StatusFlags` bits.
  uint32_t flags;
  // Number of members of the lockstep.
  uint32_t member_count;
  // Name of the scene in UTF-8, cut at 64 bytes, padded with zeros.
  uint8_t scene_name[64];
  // The members of the lockstep in the order of joining; entries beyond `member_count` are 0.
  catenary_member_status members[CATENARY_MEMBERS_MAX];
  // The changes of the members in this run.
  catenary_member_changes member_changes;
} catenary_node_status;

// State of a particle after a step: 32 bytes, alignment 4; an element of `particles`. The position
// in the payload is the particle's index everywhere.
typedef struct {
  // Position relative to the scene's origin, in the scene's unit (m).
  float position[3];
  // 1/mass in 1/kg, as used by the step: 0 for pinned, grabbed, anchored and frozen particles.
  float inverse_mass;
  // Velocity in m/s; 0 for pinned and frozen particles.
  float velocity[3];
  // `ParticleFlags` bits.
  uint32_t flags;
} catenary_particle_state;

// A snapshot, borrowed from shared memory. The data is read-only memory of another process: writing to
// it ends the program.
//
// It is valid until `catenary_release_snapshot`, also after the client was detached or the node has
// ended. A client may hold four snapshots at a time.
typedef struct {
  // The header.
  const catenary_snapshot_header *header;
  // The particles, by index.
  const catenary_particle_state *particles;
  // Number of particles.
  size_t particle_count;
  // For the library; 0 after the release.
  size_t handle;
} catenary_snapshot;

// Outcome of a command: 296 bytes, alignment 8. The owner of the name writes one for every command
// that it receives, and for every grab that ends with its connection, in the order of application. Re-simulation follows that order.
typedef struct {
  // Same as in `catenary_snapshot_header`.
  uint64_t run_id;
  // Position in the run's log, from 0, without gaps.
  uint64_t index;
  // First step that shows the effect. A node that is asked to stop may give up this step.
  uint64_t step;
  // An `catenary_outcome_status` as a number.
  uint32_t status;
  // A `catenary_reason` as a number; 0 if applied.
  uint32_t reason;
  // `CATENARY_OUTCOME_CONTROL`, `CATENARY_OUTCOME_DISCONNECTED` or `CATENARY_OUTCOME_NEW_RUN`, else 0.
  uint32_t flags;
  // Always 0.
  uint32_t spare;
  // The command as it was sent.
  catenary_command command;
} catenary_outcome;

// A complete state for `catenary_restore`, or the motion of its particles.
typedef struct {
  // `scene_hash` of the load header of the scene that the state belongs to.
  uint64_t scene_hash;
  // All particles of the scene.
  const catenary_particle_state *particles;
  // Number of particles.
  size_t particle_count;
  // The bytes of the keyframe of the same step. Null for positions and velocities only.
  const uint8_t *keyframe;
  // Number of bytes.
  size_t keyframe_size_bytes;
} catenary_state_to_restore;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Attaches to a running node with a random client id.
//
// `name` is the name of the node; null for "sim". `domain` is its domain; null for the environment
// variable CATENARY_DOMAIN, and without it for iceoryx2's own domain.
//
// On success, `*client` is the client. Pass it to `catenary_detach` at the end.
catenary_result catenary_attach(const char *name, const char *domain, catenary_client **client);

// Attaches like `catenary_attach`, as the client `client_id`, below 2^53. Only clients with this id can
// move the particles that it grabs. Members of a lockstep with fixed ids produce the same states in
// every run. Several processes may use 0; any other id belongs to one process at a time.
catenary_result catenary_attach_as(const char *name,
                                   const char *domain,
                                   uint64_t client_id,
                                   catenary_client **client);

// Detaches a client: leaves the lockstep, and waits at most 0.2 s for the outcomes of sent commands. The
// node releases the particles that the client has grabbed.
//
// Snapshots that the program holds stay valid until they are released; all other data of the client
// ends here. If another thread is in a call of the client, it is detached at the end of that call.
catenary_result catenary_detach(catenary_client *client);

// Writes the id in this client's commands and in their outcomes.
catenary_result catenary_client_id(const catenary_client *client, uint64_t *client_id);

// Returns `CATENARY_OK` if the node lives, and `CATENARY_GONE` if it has ended. Reads the file system:
// call it a few times per second at most.
catenary_result catenary_check_node(const catenary_client *client);

// Returns the contract version of this library. A program compares it with `CATENARY_CONTRACT_VERSION`
// of the header that it was compiled with: layouts are equal if they are. Nodes of another version are
// refused by `catenary_attach`.
uint32_t catenary_contract_version(void);

// Releases a particle that this client has grabbed, with the velocity of its last motion.
catenary_command catenary_command_release(uint32_t particle);

// Releases a grabbed particle, whichever client has grabbed it.
catenary_command catenary_command_release_forced(uint32_t particle);

// Sets the velocity of the free particles within a sphere (`center`: 3 numbers; both in m) to `delta`
// (3 numbers, in m per step) times the rate.
catenary_command catenary_command_push(const float *center,
                                       float radius,
                                       const float *delta);

// Pushes like `catenary_command_push`, with a limit in m on each component of `delta`.
catenary_command catenary_command_push_limited(const float *center,
                                               float radius,
                                               const float *delta,
                                               float limit);

// Moves an anchor to a pose, where it stays: by the end of the next step, or in the time that
// `catenary_command_with_over` gives. `translation` (3 numbers, in m) and `rotation` (quaternion x, y, z, w) are relative to
// the pose at load. A null `rotation` is no rotation.
catenary_command catenary_command_move_anchor(uint32_t anchor,
                                              const float *translation,
                                              const float *rotation);

// Moves a collider to a pose during the next step, with the velocity that this implies; see
// `catenary_command_move_anchor`.
catenary_command catenary_command_move_collider(uint32_t collider,
                                                const float *translation,
                                                const float *rotation);

// Gives a `catenary_command_move_anchor` or `catenary_command_move_collider` the time in which it reaches its pose, in
// seconds: 0 to 3600, rounded up to whole steps, at least one. Other commands stay as they are.
catenary_command catenary_command_with_over(catenary_command motion,
                                            float over_s);

// Leads an object (`object` is a `catenary_moved_object`) along the points of `catenary_command_with_point`: an anchor, a
// collider, or a particle that this client has grabbed.
catenary_command catenary_command_follow(uint32_t object,
                                         uint32_t object_index);

// Adds a point to a `catenary_command_follow`, which has at most 4: the time in seconds after the step of the command that
// begins the motion, ascending, and a pose as in `catenary_command_move_anchor`; for a particle a position, in m. A
// fifth point or a null translation makes the empty command. Other commands stay as they are.
catenary_command catenary_command_with_point(catenary_command follow,
                                             double time_s,
                                             const float *translation,
                                             const float *rotation);

// Appends the points of a `catenary_command_follow` to the motion that an earlier one began, and whose times go on. Other
// commands stay as they are.
catenary_command catenary_command_appended(catenary_command follow);

// Moves a body through the next step, with its mass and inertia. `translation` and `rotation` are as in
// `catenary_command_move_anchor`; `velocity` (m/s) and `angular_velocity` (rad/s) are those at the start of the step.
// A null velocity is 0. `catenary_command_with_wrench` adds a force and a torque.
catenary_command catenary_command_drive_body(uint32_t collider,
                                             const float *translation,
                                             const float *rotation,
                                             const float *velocity,
                                             const float *angular_velocity);

// Adds a force (N) on the center of the body and a torque (N m) about it to a `catenary_command_drive_body`,
// beside gravity and the contacts. A null vector is 0. Other commands stay as they are.
catenary_command catenary_command_with_wrench(catenary_command command,
                                              const float *force,
                                              const float *torque);

// Sets a parameter, such as "damping", to a number.
catenary_command catenary_command_set(const char *parameter, float value);

// Sets a parameter, such as "gravity", to three numbers.
catenary_command catenary_command_set_vector(const char *parameter, const float *value);

// Switches a parameter off, such as the limit `tear_force`.
catenary_command catenary_command_set_off(const char *parameter);

// Returns a command that sets "compliance" or "stiffness", for the constraints of one kind only (a
// `catenary_constraint_kind`). Any other command is returned unchanged.
catenary_command catenary_command_for_kind(catenary_command set, uint32_t constraint_kind);

// Returns a command that sets "bending", for the bends of one generated block only: the index of the
// `[[generate]]` block in the scene. A node rejects a block for another parameter. Any command other than a set is
// returned unchanged.
catenary_command catenary_command_for_block(catenary_command set,
                                            uint32_t block);

// Returns a command that sets "friction" or "restitution", for one collider only: its index in the scene. A node
// rejects a collider for another parameter. Any command other than a set is returned unchanged.
catenary_command catenary_command_for_collider(catenary_command set,
                                               uint32_t collider);

// Puts the nearest kept state at or before a step of this run in place; `catenary_command_rewound_step` of the outcome's command
// returns its step.
catenary_command catenary_command_rewind_to(uint64_t step);

// Returns the step of the state that a rewind has put in place, from the command of its outcome; `UINT64_MAX` for another
// command.
uint64_t catenary_command_rewound_step(catenary_command rewind);

// Puts the nearest kept state at least a number of steps ago in place.
catenary_command catenary_command_rewind_back(uint32_t steps);

// Holds a particle in place.
//
// - `particle`: Index of the particle.
catenary_command catenary_command_pin(uint32_t particle);

// Frees a pinned particle. Its velocity is 0.
//
// - `particle`: Index of the particle.
catenary_command catenary_command_unpin(uint32_t particle);

// Grabs a particle, which moves along a straight line to a target.
//
// - `particle`: Index of the particle.
// - `target` (3 numbers): Target in m, relative to the scene's origin.
// - `over_s`: Time to the target in seconds, 0..=3600, rounded up to whole steps.
catenary_command catenary_command_grab(uint32_t particle, const float *target, float over_s);

// Sets a new target for a particle that this client has grabbed.
//
// - `particle`: Index of the particle.
// - `target` (3 numbers): Target in m, relative to the scene's origin.
// - `over_s`: Time to the target in seconds, 0..=3600, rounded up to whole steps.
catenary_command catenary_command_move(uint32_t particle, const float *target, float over_s);

// Pauses the node at this boundary.
catenary_command catenary_command_pause(void);

// Resumes a paused node.
catenary_command catenary_command_resume(void);

// Makes a paused node perform `count` steps.
//
// - `count`: Number of steps, 1 or more.
catenary_command catenary_command_step(uint32_t count);

// Restores the initial state as the state of the next step. The step number continues.
catenary_command catenary_command_reset(void);

// Tears a constraint.
//
// - `constraint`: Index of the constraint.
catenary_command catenary_command_cut(uint32_t constraint);

// Tears every constraint with an end inside a sphere.
//
// - `center` (3 numbers): Center of the sphere in m, relative to the scene's origin.
// - `radius`: Radius of the sphere in m. An end at exactly this distance is outside.
catenary_command catenary_command_cut_radius(const float *center, float radius);

// Tears every constraint that crosses a strip: a segment extended to both sides.
//
// - `from` (3 numbers): Start of the segment in m, relative to the scene's origin.
// - `to` (3 numbers): End of the segment in m, relative to the scene's origin.
// - `direction` (3 numbers): Direction in which the segment extends to both sides without limit; [0, 0, 1] for a planar scene.
catenary_command catenary_command_cut_segment(const float *from,
                                              const float *to,
                                              const float *direction);

// Replaces the scene.
//
// - `scene`: Name of a built-in scene, or path of a file on the node's host.
catenary_command catenary_command_load(const char *scene);

// Marks the step in the log. Changes nothing else.
//
// - `text`: Text for people and for programs that read the log. Empty text is rejected.
catenary_command catenary_command_mark(const char *text);

// Reads the newest forces on colliders, anchors and pinned, grabbed or anchored particles, and waits only if
// none have arrived. The rows are valid until the next call of this function with this client.
//
// A node computes forces only while a client reads them: from the first call on, until the client is
// detached. So the first call waits for the next step. A member of the lockstep calls it once with the
// timeout 0 before its first turn.
catenary_result catenary_read_forces(catenary_client *client,
                                     double timeout_s,
                                     catenary_forces *forces);

// Reads the forces of the step of a snapshot. `snapshot` is its header, or a copy of it. Call it for snapshots
// in their order. The rows are valid until the next call of this function with this client.
//
// `CATENARY_TIMEOUT` means that there are none: the snapshot is from before the first call of one of the two
// functions, or more than 64 snapshots old, or the client has read forces of a later step.
catenary_result catenary_read_forces_of(catenary_client *client,
                                        const catenary_snapshot_header *snapshot,
                                        double timeout_s,
                                        catenary_forces *forces);

// Reads the newest topology, and waits only if none was published yet. The list is valid until the next
// call of this function with this client.
catenary_result catenary_read_topology(catenary_client *client,
                                       double timeout_s,
                                       catenary_topology *topology);

// Reads the newest bends, like `catenary_read_topology`.
catenary_result catenary_read_bends(catenary_client *client,
                                    double timeout_s,
                                    catenary_bends *bends);

// Reads the newest surface, like `catenary_read_topology`.
catenary_result catenary_read_surface(catenary_client *client,
                                      double timeout_s,
                                      catenary_surface *surface);

// Reads the list of torn constraints, like `catenary_read_topology`.
catenary_result catenary_read_torn(catenary_client *client, double timeout_s, catenary_torn *torn);

// Reads the values of all parameters, like `catenary_read_topology`.
catenary_result catenary_read_parameters(catenary_client *client,
                                         double timeout_s,
                                         catenary_parameters *parameters);

// Reads the colliders in their newest poses, like `catenary_read_topology`.
catenary_result catenary_read_colliders(catenary_client *client,
                                        double timeout_s,
                                        catenary_colliders *colliders);

// Reads the newest scene as TOML in UTF-8, like `catenary_read_topology`.
catenary_result catenary_read_scene(catenary_client *client, double timeout_s, const char **scene);

// Copies the newest unread status, or waits for the next one. A node publishes ten per second.
catenary_result catenary_read_status(catenary_client *client,
                                     double timeout_s,
                                     catenary_node_status *status);

// Joins the lockstep: from now on, the node waits in each turn of this client until the client has called
// `catenary_ready`. The commands that the client sends before that take effect in the next step, so the run is the same each
// time.
//
// The first turn is at the step of joining, and each further turn `every` steps after the last one; 1 is each step. A step
// that shows a load, a reset, a rewind or a restored state is always a turn, and so is step 0 of a new run; the next turn
// counts from there. A turn that falls on a step that the node does not publish (--every) moves to the next published step.
//
// The node goes on without a client that it has waited for too long: 2 s, unless it was started with
// another --lockstep-timeout. `catenary_missed_turns` shows it.
catenary_result catenary_join_lockstep(catenary_client *client,
                                       uint32_t every,
                                       double timeout_s);

// Borrows the newest snapshot that the node waits for this client at, or waits for it. Release the
// snapshot, and call `catenary_ready` after sending the commands of the turn. `CATENARY_TIMEOUT` means
// that the node is paused, or waits for another member or for its deadline.
catenary_result catenary_next_turn(catenary_client *client,
                                   double timeout_s,
                                   catenary_snapshot *snapshot);

// Ends the turn that `catenary_next_turn` has begun.
catenary_result catenary_ready(catenary_client *client);

// Gets the number of turns that the node has computed without this client since it joined, up to the last turn
// of `catenary_next_turn`, because it was not ready in time. Turns of a replay are not counted.
catenary_result catenary_missed_turns(catenary_client *client,
                                      uint64_t *count);

// Leaves the lockstep: the node goes on without waiting for this client. Detaching does the same.
catenary_result catenary_leave_lockstep(catenary_client *client);

// Returns the name of a reason, such as `not_grabbed`; "unknown" for another number. It is valid as long
// as the process.
const char *catenary_reason_name(uint32_t reason);

// Returns the name of a parameter, such as "gravity"; "unknown" for another number. It is valid as long
// as the process.
const char *catenary_parameter_name(uint32_t parameter);

// Returns the text of the last failed call of this thread, in UTF-8 and never null: the cause, and the
// cure where one is known, such as the allowed values of a rejected command. Empty if no call has failed.
//
// The text is valid until the next failed call of this thread.
const char *catenary_last_error(void);

// Sends a command and waits for its outcome, applied or rejected. `*outcome` is written in both cases;
// it may be null.
//
// `CATENARY_OK` means that the command took effect, at `outcome->step`. A member of the lockstep sends
// commands of its turn with `catenary_send`, because the outcome comes only after the turn.
catenary_result catenary_request(catenary_client *client,
                                 catenary_command command,
                                 double timeout_s,
                                 catenary_outcome *outcome);

// Sends a command without waiting. Only the outcome proves that it took effect; see
// `catenary_next_outcome`. `*sequence`, if it is not null, is the number in `outcome.command.sequence`.
catenary_result catenary_send(catenary_client *client,
                              catenary_command command,
                              uint64_t *sequence);

// Reads the next outcome of this client's commands, applied or rejected (`outcome->status`), in the order
// of application. Those that `catenary_request` has returned are left out. A client reads it often
// enough: the library keeps the last 2048.
catenary_result catenary_next_outcome(catenary_client *client,
                                      double timeout_s,
                                      catenary_outcome *outcome);

// Gives a state to the node, which puts it in place at the next boundary, and waits for the outcome as
// `catenary_request` does. The node rejects a state that is damaged or belongs to another scene.
catenary_result catenary_restore(catenary_client *client,
                                 const catenary_state_to_restore *state,
                                 double timeout_s,
                                 catenary_outcome *outcome);

// Borrows the oldest unread snapshot, or waits for the next one. The first call of a client returns the
// latest published one. A client that is more than 64 snapshots behind misses some; `snapshot_index` of
// the header shows it. Release each snapshot.
catenary_result catenary_next_snapshot(catenary_client *client,
                                       double timeout_s,
                                       catenary_snapshot *snapshot);

// Borrows the newest unread snapshot and skips those before it, or waits for the next one. Release each
// snapshot.
catenary_result catenary_latest_snapshot(catenary_client *client,
                                         double timeout_s,
                                         catenary_snapshot *snapshot);

// Returns a snapshot to the node, and sets all fields of `*snapshot` to 0. Another release, or the
// release of a copy, is `CATENARY_MISUSE`. Any thread may release it.
catenary_result catenary_release_snapshot(catenary_snapshot *snapshot);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

// The sizes of the messages in shared memory.
typedef char catenary_check_snapshot_header[sizeof(catenary_snapshot_header) == 112 ? 1 : -1];
typedef char catenary_check_particle_state[sizeof(catenary_particle_state) == 32 ? 1 : -1];
typedef char catenary_check_load_header[sizeof(catenary_load_header) == 72 ? 1 : -1];
typedef char catenary_check_constraint_state[sizeof(catenary_constraint_state) == 20 ? 1 : -1];
typedef char catenary_check_bend_state[sizeof(catenary_bend_state) == 52 ? 1 : -1];
typedef char catenary_check_triangle[sizeof(catenary_triangle) == 12 ? 1 : -1];
typedef char catenary_check_tears_header[sizeof(catenary_tears_header) == 32 ? 1 : -1];
typedef char catenary_check_torn_constraint[sizeof(catenary_torn_constraint) == 8 ? 1 : -1];
typedef char catenary_check_parameters_header[sizeof(catenary_parameters_header) == 24 ? 1 : -1];
typedef char catenary_check_parameter_state[sizeof(catenary_parameter_state) == 28 ? 1 : -1];
typedef char catenary_check_colliders_header[sizeof(catenary_colliders_header) == 24 ? 1 : -1];
typedef char catenary_check_collider_state[sizeof(catenary_collider_state) == 120 ? 1 : -1];
typedef char catenary_check_forces_header[sizeof(catenary_forces_header) == 24 ? 1 : -1];
typedef char catenary_check_force_row[sizeof(catenary_force_row) == 40 ? 1 : -1];
typedef char catenary_check_command[sizeof(catenary_command) == 256 ? 1 : -1];
typedef char catenary_check_outcome[sizeof(catenary_outcome) == 296 ? 1 : -1];
typedef char catenary_check_node_status[sizeof(catenary_node_status) == 1376 ? 1 : -1];

#endif  /* CATENARY_H */
