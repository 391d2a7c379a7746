//! Freezes the facts that programs in other languages rely on: sizes, alignments, offsets and type
//! names in shared memory, the limits and the event ids. Any change of these texts is a change of
//! the contract's version.

use std::fmt::Write as _;
use std::mem::offset_of;

use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use sim_contract::{
    BendState, ColliderState, CollidersHeader, Command, ConstraintState, ForceRow, ForcesHeader,
    KeyframeHeader, LoadHeader, MemberChange, MemberChanges, MemberStatus, NodeStatus, Outcome,
    ParameterState, ParametersHeader, ParticleState, Ready, RestoreHeader, SnapshotHeader,
    TearsHeader, TornConstraint, Triangle, Wake,
};

macro_rules! layout {
    ($text:ident, $type:ident { $($field:ident),+ $(,)? }) => {{
        // The pattern names every field, so a new field that is not listed here does not compile.
        let $type { $($field: _),+ } = $type::default();
        writeln!(
            $text,
            "{} size {} alignment {}",
            TypeDetail::new::<$type>(TypeVariant::FixedSize).type_name(),
            size_of::<$type>(),
            align_of::<$type>(),
        )
        .unwrap();
        $(writeln!($text, "  {:>3} {}", offset_of!($type, $field), stringify!($field)).unwrap();)+
    }};
}

macro_rules! constants {
    ($text:ident, $($name:ident),+ $(,)?) => {
        $(writeln!($text, "{} = {}", stringify!($name), sim_contract::$name).unwrap();)+
    };
}

#[test]
fn the_layout_of_shared_memory_is_frozen() {
    insta::assert_snapshot!("layout", layouts());
}

/// Returns the name, size and alignment of each type, each followed by the offsets of its fields.
pub(crate) fn layouts() -> String {
    let mut text = String::new();
    write_state_layouts(&mut text);
    write_command_and_status_layouts(&mut text);
    text
}

#[allow(clippy::too_many_lines, reason = "a line for each field")]
fn write_state_layouts(text: &mut String) {
    layout!(text, ParticleState { position, inverse_mass, velocity, flags });
    layout!(
        text,
        SnapshotHeader {
            contract_version,
            solver_version,
            run_id,
            step,
            scene_step,
            keyframe_step,
            sim_time_ns,
            publish_monotonic_ns,
            state_hash,
            outcome_count,
            wake_late_ns,
            solve_ns,
            topology_revision,
            torn_count,
            particle_count,
            flags,
            stride,
            snapshot_index,
        }
    );
    layout!(text, ConstraintState { a, b, rest_length, compliance, kind });
    layout!(text, BendState { particles, coefficients, geometry, rigidity, rest, shape, block });
    layout!(text, Triangle { corners });
    layout!(
        text,
        LoadHeader {
            run_id,
            step,
            scene_hash,
            origin,
            topology_revision,
            count,
            particle_count,
            rate_hz,
            method,
            spare,
        }
    );
    layout!(text, TearsHeader { run_id, step, since_step, new_count, count });
    layout!(text, TornConstraint { constraint, cause });
    layout!(text, ParametersHeader { run_id, step, count, spare });
    layout!(text, ParameterState { parameter, constraint_kind, block, form, value });
    layout!(
        text,
        ColliderState {
            shape,
            restitution,
            friction,
            radius,
            offset,
            normal,
            center,
            half_extents,
            rotation,
            a,
            b,
            velocity,
            angular_velocity,
        }
    );
    layout!(text, CollidersHeader { run_id, step, count, list_index });
    layout!(text, ForcesHeader { run_id, step, count, rate_hz });
    layout!(text, ForceRow { kind, index, impulse, angular_impulse, contacts, spare });
    layout!(
        text,
        KeyframeHeader { run_id, step, size_bytes, outcome_count, published_outcome_count }
    );
}

fn write_command_and_status_layouts(text: &mut String) {
    layout!(text, Command { kind, spare, client_id, sequence, fields });
    layout!(text, Outcome { run_id, index, step, status, reason, flags, spare, command });
    layout!(
        text,
        NodeStatus {
            contract_version,
            solver_version,
            run_id,
            step,
            real_time_factor,
            time_scale,
            wake_late_ns_p50,
            wake_late_ns_p99,
            solve_ns_p50,
            solve_ns_p99,
            late_steps,
            skipped_periods,
            outcome_count,
            rejected_count,
            frozen_count,
            standing_body_steps,
            rate_hz,
            particle_count,
            constraint_count,
            torn_count,
            reader_count,
            process_id,
            flags,
            member_count,
            scene_name,
            members,
            member_changes,
        }
    );
    layout!(text, MemberStatus { client_id, step, every, is_awaited });
    layout!(text, MemberChanges { count, last });
    layout!(text, MemberChange { client_id, step, every, kind });
    layout!(text, Ready { client_id, run_id, step, every, tag });
    layout!(
        text,
        RestoreHeader { client_id, sequence, scene_hash, size_bytes, particle_count, contents }
    );
}

#[test]
fn the_limits_are_frozen() {
    let mut text = String::new();
    constants!(
        text,
        CONTRACT_VERSION,
        SETTINGS_COUNT,
        ELEMENTS_MAX,
        COLLIDERS_MAX,
        SCENE_SIZE_BYTES_MAX,
        COMMANDS_PER_STEP_MAX,
        OWNER_PUBLISHERS_MAX,
        READERS_MAX,
        MEMBERS_MAX,
        MEMBER_CHANGES_KEPT,
        READY_BUFFERED,
        RESTORES_MAX,
        BORROWED_SAMPLES_MAX,
        BORROWED_UPDATES_MAX,
        SNAPSHOTS_BUFFERED,
        KEYFRAMES_BUFFERED,
        UPDATES_BUFFERED,
        OUTCOMES_BUFFERED,
        CLIENTS_MAX,
        COMMANDS_BUFFERED,
        OUTCOME_READERS_MAX,
        COMMAND_READERS_MAX,
        STATUS_PUBLISHERS_MAX,
        LISTENERS_MAX,
        PARTICIPANTS_MAX,
    );
    insta::assert_snapshot!("limits", text);
}

#[test]
fn the_event_ids_are_frozen() {
    let events =
        [Wake::Frame, Wake::Load, Wake::Tears, Wake::Outcome, Wake::Status, Wake::OwnerGone];
    let mut text = String::new();
    for event in events {
        writeln!(text, "{} {event:?}", event as u32).unwrap();
    }
    insta::assert_snapshot!("events", text);
}
