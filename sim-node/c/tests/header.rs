//! The header is generated from the Rust types, and compiles as C99 and as C++17 without a warning. The constructors of
//! commands are generated from the table of actions. To update both after a change:
//! `UPDATE_GOLDEN=1 cargo test -p sim-c --test integration header`

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use cbindgen::{
    Builder, Config, DocumentationStyle, EnumConfig, ItemType, Language, RenameRule, Style,
};
use sim_contract::{
    ACTIONS, Action, BendState, CONTRACT_VERSION, ColliderState, CollidersHeader, ConstraintState,
    FieldForm, FieldInfo, ForceRow, ForcesHeader, LoadHeader, MEMBER_CHANGES_KEPT, MEMBERS_MAX,
    NodeStatus, OUTCOME_FLAG_CONTROL, OUTCOME_FLAG_DISCONNECTED, OUTCOME_FLAG_NEW_RUN, Outcome,
    ParameterState, ParametersHeader, ParticleFlags, ParticleState, SnapshotFlags, SnapshotHeader,
    StatusFlags, TearsHeader, Text, TornConstraint, Triangle,
};

/// Types with their names in the header. The last ones are in no signature: numbers in messages.
const TYPES: [(&str, &str); 41] = [
    ("CatenaryResult", "catenary_result"),
    ("ClientHandle", "catenary_client"),
    ("Snapshot", "catenary_snapshot"),
    ("Topology", "catenary_topology"),
    ("Bends", "catenary_bends"),
    ("Surface", "catenary_surface"),
    ("Torn", "catenary_torn"),
    ("Parameters", "catenary_parameters"),
    ("Colliders", "catenary_colliders"),
    ("Forces", "catenary_forces"),
    ("StateToRestore", "catenary_state_to_restore"),
    ("SnapshotHeader", "catenary_snapshot_header"),
    ("ParticleState", "catenary_particle_state"),
    ("ConstraintState", "catenary_constraint_state"),
    ("BendState", "catenary_bend_state"),
    ("Triangle", "catenary_triangle"),
    ("LoadHeader", "catenary_load_header"),
    ("TearsHeader", "catenary_tears_header"),
    ("TornConstraint", "catenary_torn_constraint"),
    ("ParametersHeader", "catenary_parameters_header"),
    ("ParameterState", "catenary_parameter_state"),
    ("CollidersHeader", "catenary_colliders_header"),
    ("ColliderState", "catenary_collider_state"),
    ("ForcesHeader", "catenary_forces_header"),
    ("ForceRow", "catenary_force_row"),
    ("Command", "catenary_command"),
    ("Outcome", "catenary_outcome"),
    ("NodeStatus", "catenary_node_status"),
    ("MemberStatus", "catenary_member_status"),
    ("MemberChanges", "catenary_member_changes"),
    ("MemberChange", "catenary_member_change"),
    ("OutcomeStatus", "catenary_outcome_status"),
    ("Reason", "catenary_reason"),
    ("ConstraintKind", "catenary_constraint_kind"),
    ("ColliderShape", "catenary_collider_shape"),
    ("TearCause", "catenary_tear_cause"),
    ("ForceKind", "catenary_force_kind"),
    ("Method", "catenary_method"),
    ("Parameter", "catenary_parameter"),
    ("MovedObject", "catenary_moved_object"),
    ("MemberChangeKind", "catenary_member_change_kind"),
];

/// Constants with their names in the header, their values, and their meanings.
#[rustfmt::skip]
#[allow(clippy::cast_possible_truncation, reason = "small limits")]
const CONSTANTS: [(&str, &str, u32, &str); 18] = [
    ("CONTRACT_VERSION", "CATENARY_CONTRACT_VERSION", CONTRACT_VERSION, "version of the layouts of this header"),
    ("MEMBERS_MAX", "CATENARY_MEMBERS_MAX", MEMBERS_MAX as u32, "most members of the lockstep"),
    ("MEMBER_CHANGES_KEPT", "CATENARY_MEMBER_CHANGES_KEPT", MEMBER_CHANGES_KEPT as u32, "changes that a status names"),
    ("FIELDS_SIZE_BYTES", "CATENARY_FIELDS_SIZE_BYTES", Action::FIELDS_SIZE_BYTES as u32, "bytes of the fields of a command"),
    ("SIZE_BYTES_MAX", "CATENARY_TEXT_SIZE_BYTES_MAX", Text::SIZE_BYTES_MAX as u32, "longest text of a command"),
    ("ParticleFlags::PINNED", "CATENARY_PARTICLE_PINNED", ParticleFlags::PINNED, "held in place"),
    ("ParticleFlags::GRABBED", "CATENARY_PARTICLE_GRABBED", ParticleFlags::GRABBED, "driven by a client"),
    ("ParticleFlags::ANCHORED", "CATENARY_PARTICLE_ANCHORED", ParticleFlags::ANCHORED, "moved by an anchor"),
    ("ParticleFlags::FROZEN", "CATENARY_PARTICLE_FROZEN", ParticleFlags::FROZEN, "excluded: its state was not finite"),
    ("SnapshotFlags::PAUSED", "CATENARY_SNAPSHOT_PAUSED", SnapshotFlags::PAUSED, "the node was paused in this step"),
    ("SnapshotFlags::REPLAY", "CATENARY_SNAPSHOT_REPLAY", SnapshotFlags::REPLAY, "the writer plays a recording"),
    ("SnapshotFlags::IN_PLACE", "CATENARY_SNAPSHOT_IN_PLACE", SnapshotFlags::IN_PLACE, "a command has put the state in place"),
    ("StatusFlags::PAUSED", "CATENARY_STATUS_PAUSED", StatusFlags::PAUSED, "the node waits for resume or step"),
    ("StatusFlags::REPLAY", "CATENARY_STATUS_REPLAY", StatusFlags::REPLAY, "the writer plays a recording"),
    ("StatusFlags::AT_END", "CATENARY_STATUS_AT_END", StatusFlags::AT_END, "the recording has ended"),
    ("OUTCOME_FLAG_CONTROL", "CATENARY_OUTCOME_CONTROL", OUTCOME_FLAG_CONTROL, "answers a command to a replay"),
    ("OUTCOME_FLAG_DISCONNECTED", "CATENARY_OUTCOME_DISCONNECTED", OUTCOME_FLAG_DISCONNECTED, "release of a lost grab"),
    ("OUTCOME_FLAG_NEW_RUN", "CATENARY_OUTCOME_NEW_RUN", OUTCOME_FLAG_NEW_RUN, "the scene begins a new run at step 0"),
];

const INTRODUCTION: &str = "\
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
";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn generate() -> String {
    let mut config = Config {
        language: Language::C,
        style: Style::Type,
        cpp_compat: true,
        include_guard: Some("CATENARY_H".to_owned()),
        header: Some(INTRODUCTION.to_owned()),
        no_includes: true,
        sys_includes: vec!["stddef.h".to_owned(), "stdint.h".to_owned()],
        after_includes: Some(definitions()),
        usize_is_size_t: true,
        documentation_style: DocumentationStyle::C99,
        enumeration: EnumConfig {
            rename_variants: RenameRule::QualifiedScreamingSnakeCase,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    config.parse.parse_deps = true;
    config.parse.include =
        Some(["sim-contract", "sim-messages", "sim-types"].map(str::to_owned).to_vec());
    config.export.include = TYPES.iter().map(|(rust, _)| (*rust).to_owned()).collect();
    // Their constants make them opaque types.
    config.export.exclude = ["Action", "NumberRange", "ParticleFlags"].map(str::to_owned).to_vec();
    config.export.item_types =
        vec![ItemType::Enums, ItemType::Structs, ItemType::OpaqueItems, ItemType::Functions];
    config.export.rename = names().map(|(rust, c)| (rust.to_owned(), c.to_owned())).collect();
    let mut header = Vec::new();
    Builder::new().with_crate(folder()).with_config(config).generate().unwrap().write(&mut header);
    let header = String::from_utf8(header).unwrap();
    let (header, end) = header.rsplit_once("#endif").unwrap();
    let header = format!("{header}{}\n#endif{end}", checks());
    header.lines().map(|line| adapt(line) + "\n").collect()
}

fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    TYPES.into_iter().chain(CONSTANTS.map(|(rust, c, ..)| (rust, c)))
}

fn definitions() -> String {
    let mut text = String::new();
    for (_, name, value, meaning) in CONSTANTS {
        writeln!(text, "#define {name} {value}  // {meaning}").unwrap();
    }
    text
}

/// Refuses to compile where the layout of a message differs from the Rust type.
fn checks() -> String {
    let mut text = "// The sizes of the messages in shared memory.\n".to_owned();
    let mut add = |name: &str, size_bytes: usize| {
        let condition = format!("sizeof(catenary_{name}) == {size_bytes} ? 1 : -1");
        writeln!(text, "typedef char catenary_check_{name}[{condition}];").unwrap();
    };
    add("snapshot_header", size_of::<SnapshotHeader>());
    add("particle_state", size_of::<ParticleState>());
    add("load_header", size_of::<LoadHeader>());
    add("constraint_state", size_of::<ConstraintState>());
    add("bend_state", size_of::<BendState>());
    add("triangle", size_of::<Triangle>());
    add("tears_header", size_of::<TearsHeader>());
    add("torn_constraint", size_of::<TornConstraint>());
    add("parameters_header", size_of::<ParametersHeader>());
    add("parameter_state", size_of::<ParameterState>());
    add("colliders_header", size_of::<CollidersHeader>());
    add("collider_state", size_of::<ColliderState>());
    add("forces_header", size_of::<ForcesHeader>());
    add("force_row", size_of::<ForceRow>());
    add("command", size_of::<sim_contract::Command>());
    add("outcome", size_of::<Outcome>());
    add("node_status", size_of::<NodeStatus>());
    text
}

/// Gives a comment the names of the header instead of links to Rust items.
fn adapt(line: &str) -> String {
    let mut line = line.replace("CATENARY_RESULT_", "CATENARY_");
    if !line.trim_start().starts_with("//") {
        return line;
    }
    while let Some(start) = line.find("`](") {
        let end = start + line[start..].find(')').unwrap();
        line.replace_range(start + 1..=end, "");
    }
    line = line.replace("[`", "`").replace("`]", "`").replace("crate::", "");
    line = line.replace("u32::MAX", "UINT32_MAX");
    for (rust, c) in names() {
        line = line.replace(&format!("`{rust}`"), &format!("`{c}`"));
    }
    line.trim_end().to_owned()
}

#[test]
fn the_committed_files_are_those_of_the_rust_types() {
    // In this order: the header declares the constructors.
    check("src/constructors.rs", &constructors());
    check("include/catenary.h", &generate());
}

fn check(file: &str, expected: &str) {
    let path = folder().join(file);
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, expected).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    let differs = committed.lines().zip(expected.lines()).find(|(old, new)| old != new);
    assert!(
        committed == expected,
        "{file}: run UPDATE_GOLDEN=1 cargo test -p sim-c --test integration header; first difference: {differs:?}"
    );
}

/// Commands with options that are functions of their own, in `src/commands.rs`, and a restore, which carries a state.
const WITH_OPTIONS: [&str; 9] = [
    "release",
    "push",
    "move_anchor",
    "move_collider",
    "set",
    "rewind",
    "restore",
    "drive_body",
    "follow",
];

/// A function for each other command, with an argument for each field.
fn constructors() -> String {
    let mut text = "//! The constructors of commands whose arguments are their fields. Generated from the table of actions; do not \
        edit.\n\nuse std::ffi::c_char;\n\nuse sim_contract::{Action, Command};\n\nuse crate::commands::{made, short_text};\n\
        use crate::pointers::numbers;\n"
        .to_owned();
    for info in ACTIONS.iter().filter(|info| !WITH_OPTIONS.contains(&info.name)) {
        writeln!(text, "\n/// {}", info.meaning).unwrap();
        for (index, field) in info.fields.iter().enumerate() {
            let line = if index == 0 { "///\n" } else { "" };
            let (_, form, _) = argument(field);
            writeln!(text, "{line}/// - `{}`{form}: {}", field.name, field.meaning).unwrap();
        }
        let arguments =
            info.fields.iter().map(|field| format!("{}: {}", field.name, argument(field).0));
        let values = info.fields.iter().map(|field| format!("{}{}", field.name, argument(field).2));
        let (arguments, values): (Vec<_>, Vec<_>) = (arguments.collect(), values.collect());
        let variant: String = info.name.split('_').map(capitalized).collect();
        let fields =
            if values.is_empty() { String::new() } else { format!(" {{ {} }}", values.join(", ")) };
        writeln!(
            text,
            "#[unsafe(no_mangle)]\npub extern \"C\" fn catenary_command_{}({}) -> Command {{ \
                made(|| Some(Action::{variant}{fields})) }}",
            info.name,
            arguments.join(", "),
        )
        .unwrap();
    }
    text
}

fn capitalized(word: &str) -> String {
    word[..1].to_uppercase() + &word[1..]
}

/// Type of an argument, its form in words, and the text that makes it the value of its field.
fn argument(field: &FieldInfo) -> (&'static str, &'static str, String) {
    let name = field.name;
    match (field.form, field.size_bytes) {
        (FieldForm::Whole, 4) => ("u32", "", String::new()),
        (FieldForm::Number, 4) => ("f32", "", String::new()),
        (FieldForm::Vector, _) => ("*const f32", " (3 numbers)", format!(": numbers({name})?")),
        (FieldForm::Rotation, _) => ("*const f32", " (4 numbers)", format!(": numbers({name})?")),
        (FieldForm::Text, _) => ("*const c_char", "", format!(": short_text({name})?")),
        _ => panic!("{name} has no argument in C: write the constructor by hand"),
    }
}

/// Compiles a file that includes a header, and nothing else.
#[allow(clippy::disallowed_methods, reason = "a test starts the compiler")]
fn compile(compiler: &str, standard: &str, header: &str) {
    let output = Command::new(compiler)
        .args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"])
        .arg(folder().join("include").join(header))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_header_compiles_as_c99_without_a_warning() {
    compile("cc", "-std=c99", "catenary.h");
}

#[test]
#[ignore = "needs a C++ compiler"]
fn the_headers_compile_as_cpp17_without_a_warning() {
    compile("c++", "-std=c++17", "catenary.h");
    compile("c++", "-std=c++17", "catenary.hpp");
}

/// Returns the words after `catenary_` that begin a call, as in `catenary_attach(`.
fn functions(header: &str) -> BTreeSet<String> {
    let is_code = |line: &&str| !line.trim_start().starts_with(['*', '/', '#']);
    let code = header.lines().filter(is_code).filter(|line| !line.contains("typedef"));
    let names = code.filter_map(|line| line.split_once('(')?.0.split([' ', '*']).next_back());
    names.filter(|name| name.starts_with("catenary_")).map(str::to_owned).collect()
}

#[allow(clippy::disallowed_methods, reason = "a test starts the lister of symbols")]
#[test]
fn the_library_exports_the_functions_of_the_header_and_nothing_else() {
    let header = std::fs::read_to_string(folder().join("include/catenary.h")).unwrap();
    let library = std::env::current_exe().unwrap().with_file_name("libcatenary.so");
    let output = Command::new("nm").args(["-D", "--defined-only"]).arg(&library).output().unwrap();
    assert!(output.status.success(), "{}", library.display());
    let listed = String::from_utf8(output.stdout).unwrap();
    let exported = listed.lines().filter_map(|line| line.split(' ').nth(2));
    assert_eq!(exported.map(str::to_owned).collect::<BTreeSet<_>>(), functions(&header));
}
