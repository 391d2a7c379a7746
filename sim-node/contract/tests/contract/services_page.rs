//! The generated tables of SERVICES.md and README.md are those of the Rust types and of the services that an owner creates. To
//! update them after a change: `UPDATE_GOLDEN=1 cargo test -p sim-contract --test contract page`

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::{
    CallbackProgression, Config, FileName, Node, NodeState, SemanticString, Service, ipc_threadsafe,
};
use iceoryx2::service::static_config::StaticConfig;
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern;
use sim_contract::testing::TestDomain;
use sim_contract::{
    ACTIONS, Action, ColliderShape, ConstraintKind, FieldForm, FieldInfo, ForceKind,
    MEMBER_CHANGES_KEPT, MEMBERS_MAX, MemberChangeKind, Method, MovedObject, OUTCOME_FLAG_CONTROL,
    OUTCOME_FLAG_DISCONNECTED, OUTCOME_FLAG_NEW_RUN, OffMeaning, OutcomeStatus, PARAMETERS,
    ParameterInfo, ParticleFlags, Ready, Reason, RestoreContents, SnapshotFlags, StatusFlags,
    TearCause, Text, Wake,
};

use crate::layout::layouts;
use crate::support::create_owner;

/// Returns the sources of the messages, for the types and the meanings of the fields.
fn sources() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../messages/src");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.map(|file| std::fs::read_to_string(file).unwrap()).collect()
}

#[test]
fn the_tables_of_the_services_page_are_those_of_the_types() {
    check_page(
        "SERVICES.md",
        &[
            ("services", services()),
            ("layouts", layout_tables()),
            ("numbers", number_tables()),
            ("commands", command_table()),
        ],
    );
}

#[test]
fn the_table_of_parameters_on_the_page_of_the_contract_is_that_of_the_types() {
    let row = |info: &ParameterInfo| {
        let ParameterInfo { name, unit, meaning, default, .. } = info;
        let default = match (info.off, default) {
            (OffMeaning::OwnOfEach, _) => "own of each".to_owned(),
            (_, default) => default.to_string(),
        };
        format!("| `{name}` | {unit} | {meaning} | {} | {default} |\n", info.allowed_values())
    };
    let head = "| parameter | unit | meaning | allowed | default |\n|---|---|---|---|---|\n";
    let rows: String = PARAMETERS.iter().map(row).collect();
    check_page("README.md", &[("parameters", head.to_owned() + &rows)]);
}

/// Compares the tables of a page with the given ones, or writes them.
fn check_page(file: &str, tables: &[(&str, String)]) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let committed = std::fs::read_to_string(&file).unwrap();
    let mut page = committed.clone();
    for (name, table) in tables {
        let start = format!("<!-- {name}: generated, see tests/contract/services_page.rs -->\n");
        let (before, rest) = page.split_once(&start).unwrap();
        let (_, after) = rest.split_once("<!-- end -->").unwrap();
        page = format!("{before}{start}\n{table}\n<!-- end -->{after}");
    }
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&file, &page).unwrap();
    } else {
        let differs = committed.lines().zip(page.lines()).find(|(old, new)| old != new);
        assert!(
            committed == page,
            "UPDATE_GOLDEN=1 updates the page; first difference: {differs:?}"
        );
    }
}

fn config(domain: &TestDomain) -> Config {
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("{}_", domain.name()).as_bytes()).unwrap();
    let root = domain.root();
    let root = iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes()).unwrap();
    config.global.set_root_path(&root);
    config
}

/// Lists the services of an owner as any program of iceoryx2 finds them.
fn services() -> String {
    let domain = TestDomain::new();
    let _owner = create_owner(&domain.endpoint()).unwrap();
    let mut rows = Vec::new();
    ipc_threadsafe::Service::list(&config(&domain), |service| {
        rows.push(service_row(&service.static_details));
        CallbackProgression::Continue
    })
    .unwrap();
    rows.sort();
    let header = "| service | payload | user header | writers | readers | history | buffer | held | when full |\n|---|---|---|---|---|---|---|---|---|\n";
    format!("{header}{}", rows.concat())
}

fn service_row(service: &StaticConfig) -> String {
    let name = service.name();
    if let MessagingPattern::Event(_) = service.messaging_pattern() {
        let event = service.event();
        let (writers, readers) = (event.max_notifiers(), event.max_listeners());
        return format!("| `{name}` | event | | {writers} | {readers} | | | | |\n");
    }
    let details = service.publish_subscribe();
    let types = details.message_type_details();
    let payload = types.payload.type_name().to_string();
    let header = match types.user_header.type_name().to_string().as_str() {
        "()" => String::new(),
        name => format!("`{name}`"),
    };
    let form = match format!("{:?}", types.payload.variant()).as_str() {
        "Dynamic" => "slice of ",
        _ => "",
    };
    let when_full =
        if details.has_safe_overflow() { "oldest is lost" } else { "newest is refused" };
    format!(
        "| `{name}` | {form}`{payload}` | {header} | {} | {} | {} | {} | {} | {when_full} |\n",
        details.max_publishers(),
        details.max_subscribers(),
        details.history_size(),
        details.subscriber_max_buffer_size(),
        details.subscriber_max_borrowed_samples(),
    )
}

/// A field as the source declares it.
struct Field {
    kind: String,
    meaning: String,
}

/// Returns the public fields of the structures in a source, by structure and name.
fn fields(source: &str) -> BTreeMap<(String, String), Field> {
    let mut fields = BTreeMap::new();
    let (mut structure, mut meaning) = (String::new(), String::new());
    for line in source.lines() {
        if let Some(name) = line.strip_prefix("pub struct ").and_then(|rest| rest.split(' ').next())
        {
            name.clone_into(&mut structure);
        }
        let line = line.trim();
        if let Some(text) = line.strip_prefix("///") {
            write!(meaning, "{} ", text.trim()).unwrap();
            continue;
        }
        if let Some((name, kind)) = line.strip_prefix("pub ").and_then(|rest| rest.split_once(": "))
        {
            let field =
                Field { kind: c_type(kind.trim_end_matches(',')), meaning: plain(&meaning) };
            fields.insert((structure.clone(), name.to_owned()), field);
        }
        meaning.clear();
    }
    fields
}

/// Returns an array type as C writes it.
fn c_type(kind: &str) -> String {
    let kind = kind
        .replace("Text::SIZE_BYTES_MAX", &Text::SIZE_BYTES_MAX.to_string())
        .replace("MEMBERS_MAX", &MEMBERS_MAX.to_string())
        .replace("MEMBER_CHANGES_KEPT", &MEMBER_CHANGES_KEPT.to_string());
    let (inner, lengths) = (kind.trim_start_matches('['), kind.trim_end_matches(']'));
    let inner = inner.split(';').next().unwrap();
    let mut lengths: Vec<_> =
        lengths.split("; ").skip(1).map(|one| one.trim_end_matches(']')).collect();
    lengths.reverse();
    lengths.iter().fold(inner.to_owned(), |text, length| format!("{text}[{length}]"))
}

/// Removes the links of a doc comment.
fn plain(text: &str) -> String {
    let mut text = text.trim().to_owned();
    while let Some(start) = text.find("`](") {
        let end = start + text[start..].find(')').unwrap();
        text.replace_range(start + 1..=end, "");
    }
    text.replace("[`", "`").replace("`]", "`").replace("crate::", "").replace('|', "\\|")
}

/// A table for each type, from the layout that the compiler gives it.
fn layout_tables() -> String {
    let sources = sources();
    let fields: BTreeMap<_, _> = sources.iter().flat_map(|text| fields(text)).collect();
    let mut text = String::new();
    let layouts = layouts();
    let mut lines = layouts.lines().peekable();
    let (mut structure, mut end) = (String::new(), 0);
    while let Some(line) = lines.next() {
        let words: Vec<_> = line.split_whitespace().collect();
        if let [name, "size", size, "alignment", alignment] = words[..] {
            name.trim_start_matches("catenary.").clone_into(&mut structure);
            end = size.parse().unwrap();
            writeln!(
                text,
                "\n### {name}\n\n{size} bytes, alignment {alignment}.\n\n\
                 | offset | size | type | field | meaning |\n|---|---|---|---|---|"
            )
            .unwrap();
            continue;
        }
        let (offset, name): (usize, _) = (words[0].parse().unwrap(), words[1]);
        let next = lines.peek().filter(|next| next.starts_with(' '));
        let next =
            next.map_or(end, |next| next.split_whitespace().next().unwrap().parse().unwrap());
        // The types have no padding: they would not be `Pod`.
        let size = next - offset;
        let Field { kind, meaning } = &fields[&(structure.clone(), name.to_owned())];
        writeln!(text, "| {offset} | {size} | {kind} | `{name}` | {meaning} |").unwrap();
    }
    text.trim_start().to_owned()
}

/// Names by their numbers, of a field that the title describes.
type Numbers = (&'static str, Vec<(u32, &'static str)>);

/// Lists of names with their numbers.
fn number_tables() -> String {
    let mut text = "| number in | values |\n|---|---|\n".to_owned();
    for (title, values) in command_numbers().into_iter().chain(state_numbers()) {
        let values: Vec<_> =
            values.iter().map(|(number, name)| format!("{number} {name}")).collect();
        writeln!(text, "| {title} | {} |", values.join(", ")).unwrap();
    }
    text
}

fn command_numbers() -> [Numbers; 8] {
    let kinds = ACTIONS.iter().map(|info| (info.number, info.name)).collect();
    let statuses = [(OutcomeStatus::Applied, "applied"), (OutcomeStatus::Rejected, "rejected")];
    let reasons = Reason::ALL.map(|one| (one as u32, one.name()));
    let contents = RestoreContents::ALL.map(|one| (one as u32, one.name()));
    let flags = [
        (OUTCOME_FLAG_CONTROL, "control"),
        (OUTCOME_FLAG_DISCONNECTED, "disconnected"),
        (OUTCOME_FLAG_NEW_RUN, "new_run"),
    ];
    let parameters = (0..).zip(PARAMETERS).map(|(number, info)| (number, info.name)).collect();
    [
        ("`kind` of a command", kinds),
        ("an object of `follow`", MovedObject::ALL.map(|one| (one as u32, one.name())).to_vec()),
        ("`status` of an outcome", statuses.map(|(one, name)| (one as u32, name)).to_vec()),
        ("`reason` of an outcome", [(0, "none")].into_iter().chain(reasons).collect()),
        ("`flags` of an outcome, bits", flags.to_vec()),
        ("`parameter`", parameters),
        ("`contents` of a restore", contents.to_vec()),
        ("`tag` of a member's message", vec![(Ready::TAG, "ready"), (Ready::REPEAT_TAG, "repeat")]),
    ]
}

fn state_numbers() -> [Numbers; 10] {
    let snapshot = [
        (SnapshotFlags::PAUSED, "paused"),
        (SnapshotFlags::REPLAY, "replay"),
        (SnapshotFlags::IN_PLACE, "in place"),
    ];
    let status = [
        (StatusFlags::PAUSED, "paused"),
        (StatusFlags::REPLAY, "replay"),
        (StatusFlags::AT_END, "at end"),
    ];
    let causes = TearCause::ALL.map(|one| (one as u32, one.name()));
    let events = [
        (Wake::Frame, "frame"),
        (Wake::Load, "load"),
        (Wake::Tears, "tears"),
        (Wake::Outcome, "outcome"),
        (Wake::Status, "status"),
        (Wake::OwnerGone, "owner gone"),
    ];
    [
        ("`flags` of a particle, bits", ParticleFlags::NAMES.to_vec()),
        ("`flags` of a snapshot, bits", snapshot.to_vec()),
        ("`flags` of a status, bits", status.to_vec()),
        (
            "`kind` of a constraint",
            ConstraintKind::ALL.map(|one| (one as u32, one.name())).to_vec(),
        ),
        ("`cause` of a tear", causes.into_iter().chain([(u32::MAX, "unknown")]).collect()),
        ("`shape` of a collider", ColliderShape::ALL.map(|one| (one as u32, one.name())).to_vec()),
        ("`kind` of a row of forces", ForceKind::ALL.map(|one| (one as u32, one.name())).to_vec()),
        ("`method` of a load", Method::ALL.map(|one| (one as u32, one.name())).to_vec()),
        (
            "`kind` of a member's change",
            MemberChangeKind::ALL.map(|one| (one as u32, one.name())).to_vec(),
        ),
        ("event of `wake`", events.map(|(one, name)| (one as u32, name)).to_vec()),
    ]
}

/// The fields of each kind of command, with their places.
fn command_table() -> String {
    let mut text = "| kind | `fields` |\n|---|---|\n".to_owned();
    for info in ACTIONS {
        let mut offset = 0;
        let fields = info.fields.iter().map(|field| {
            let at = offset;
            offset += field.size_bytes;
            format!("+{at} {} {}", wire_type(field), field.name)
        });
        let fields: Vec<_> = fields.collect();
        assert!(offset <= Action::FIELDS_SIZE_BYTES, "{}", info.name);
        writeln!(text, "| {} {} | {} |", info.number, info.name, fields.join(", ")).unwrap();
    }
    text
}

fn wire_type(field: &FieldInfo) -> &'static str {
    match (field.form, field.size_bytes) {
        (FieldForm::Whole | FieldForm::Kind, 8) => "optional u32",
        (
            FieldForm::Whole
            | FieldForm::Kind
            | FieldForm::Flag
            | FieldForm::Object
            | FieldForm::Contents,
            _,
        ) => "u32",
        (FieldForm::Long, _) => "optional u64",
        (FieldForm::Hash, _) => "u64",
        (FieldForm::Number, 8) => "optional f32",
        (FieldForm::Number, _) => "f32",
        (FieldForm::Vector, _) => "f32[3]",
        (FieldForm::Rotation, _) => "f32[4]",
        (FieldForm::Text, _) => "u8[160]",
        (FieldForm::Value, _) => "value",
        (FieldForm::Path, _) => "points",
    }
}

#[test]
fn a_process_has_the_names_of_its_program_and_of_the_node() {
    let domain = TestDomain::new();
    let _owner = create_owner(&domain.endpoint()).unwrap();
    let mut names = Vec::new();
    Node::<ipc_threadsafe::Service>::list(&config(&domain), |node| {
        if let NodeState::Alive(node) = node {
            names.push(node.details().as_ref().unwrap().name().to_string());
        }
        CallbackProgression::Continue
    })
    .unwrap();
    let program = std::env::current_exe().unwrap();
    let program = program.file_name().unwrap().to_str().unwrap().to_owned();
    assert_eq!(names, [format!("{program}:sim")]);
}
