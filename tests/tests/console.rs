//! `sim-node ctl` as a person uses it: exit codes, queries, hints and errors.

use integration_tests::{Finished, Process, Program, Sandbox, ctl};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

fn run(sandbox: &Sandbox, line: &str) -> Finished {
    let args: Vec<_> = line.split(' ').collect();
    Process::run(Program::SimNode, sandbox, &args)
}

#[test]
fn a_rejected_command_exits_with_4_and_an_applied_one_with_0() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let applied = run(&sandbox, "ctl pin 90");
    assert_eq!((applied.code, applied.stdout.as_str()), (Some(0), "applied at step 1\n"));
    let rejected = run(&sandbox, "ctl pin 168");
    let text = "rejected at step 1: unknown_particle: the scene has no such particle (allowed: 0 to \
                167)\n";
    assert_eq!((rejected.code, rejected.stdout.as_str()), (Some(4), text));
    let json = run(&sandbox, "ctl --json pin 168");
    assert_eq!(json.code, Some(4));
    assert!(json.stdout.contains(r#""status":"rejected","reason":"unknown_particle""#));
}

#[test]
fn a_rejection_names_the_remedy() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "flag", "--paused"]);
    let count = ctl(&sandbox, &["status"])["constraints"].as_u64().unwrap();
    let last_constraint = format!(
        "unknown_constraint: the scene has no such constraint (allowed: 0 to {})",
        count - 1
    );
    for (command, expected) in [
        ("cut 4000000000", last_constraint.as_str()),
        ("move-anchor 7 0 0 0", "unknown_anchor: the scene has no such anchor (it has none)"),
        ("move-collider 7 0 0 0", "unknown_collider: the scene has no such collider (allowed: 0)"),
        ("release 3", "not_grabbed: the particle is not grabbed (`ctl grab` grabs it)"),
        (
            "set tear_force inf",
            "non_finite: a number is not finite (allowed: finite numbers, or off for no limit)",
        ),
        ("grab 90 nan 0 0", "non_finite: a number is not finite (allowed: finite numbers)"),
        (
            "set bending 1",
            "no_effect_here: the command has no effect here (the scene has no bends; a scene has them with \
             the key bending of a generated cloth, rope or mesh, or with [[bend]])",
        ),
        (
            "rewind 2s",
            "unknown_step: no state at or before that step is kept (the run is only 0.00 s old; `ctl \
             rewind --to-step 0` goes to its start)",
        ),
    ] {
        let rejected = run(&sandbox, &format!("ctl {command}"));
        assert_eq!(rejected.stdout, format!("rejected at step 1: {expected}\n"));
    }
}

#[test]
fn a_wait_for_steps_ends_with_the_timeout_and_a_pause_ends_the_steps() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let late = run(&sandbox, "ctl step 100000000 --timeout 100ms");
    assert_eq!((late.code, late.stdout.as_str()), (Some(1), ""), "{}", late.stderr);
    assert!(late.stderr.contains("step 100000000 has not come in time"), "{}", late.stderr);
    assert!(late.stderr.contains("`ctl pause` ends that"), "{}", late.stderr);
    let next = ctl(&sandbox, &["pause"])["step"].as_u64();
    assert_eq!(ctl(&sandbox, &["step"])["step"].as_u64(), next);
    for count in ["0", "1.5", "4294967296"] {
        let refused = run(&sandbox, &format!("ctl step {count}"));
        assert_eq!(refused.code, Some(2));
        let range = "it must be a whole number from 1 to 4294967295";
        assert!(refused.stderr.contains(range), "{}", refused.stderr);
    }
}

#[test]
fn particles_are_printed_with_their_flags_by_name() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let all = ctl(&sandbox, &["particles"]);
    let all = all["particles"].as_array().unwrap();
    assert_eq!(all.len(), 168);
    let pinned = all.iter().filter(|one| one["flags"] == serde_json::json!(["pinned"]));
    assert_eq!(pinned.count(), 14);
    ctl(&sandbox, &["grab", "90", "0.5", "-0.2", "0.3", "--over", "0"]);
    ctl(&sandbox, &["step"]);
    let some = ctl(&sandbox, &["particles", "90", "3"]);
    assert_eq!(some["step"], 1);
    assert_eq!(some["particles"][0]["position"][0], 0.5);
    assert_eq!(some["particles"][0]["flags"], serde_json::json!(["grabbed"]));
    assert_eq!(some["particles"][1]["index"], 3);
    let table = run(&sandbox, "ctl particles 90").success();
    let row: Vec<_> = table.lines().nth(2).unwrap().split_whitespace().collect();
    assert_eq!((row[0], row[1], row[2], row[3]), ("90", "0.5000", "-0.2000", "0.3000"));
    assert_eq!(row[8], "grabbed");
    let unknown = run(&sandbox, "ctl particles 168");
    assert_eq!(
        (unknown.code, unknown.stderr.as_str()),
        (Some(1), "error: the scene has no particle 168 (allowed: 0 to 167)\n")
    );
}

#[test]
fn nearest_names_the_particle_at_a_point() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let position = ctl(&sandbox, &["particles", "90"])["particles"][0]["position"].clone();
    let point: Vec<_> = position.as_array().unwrap().iter().map(ToString::to_string).collect();
    let nearest = ctl(&sandbox, &["nearest", &point[0], &point[1], &point[2]]);
    assert_eq!((&nearest["index"], &nearest["distance"]), (&90.into(), &0.0.into()));
    assert_eq!(nearest["position"], position);
    let text = run(&sandbox, "ctl nearest -100 -2e1 -.5").success();
    assert!(text.starts_with("particle ") && text.contains(" m away (step 0)"), "{text}");
    for number in ["nan", "inf", "1e300", "-1.1e7"] {
        let refused = run(&sandbox, &format!("ctl nearest {number} 0 0"));
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{number}");
        assert!(refused.stderr.contains("(allowed: -1e7 to 1e7)"), "{}", refused.stderr);
    }
}

#[test]
fn wind_without_a_surface_is_applied_with_a_hint() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "rope", "--paused"]);
    let applied = run(&sandbox, "ctl set wind.velocity 3 0 0");
    assert_eq!((applied.code, applied.stdout.as_str()), (Some(0), "applied at step 1\n"));
    assert_eq!(applied.stderr, "hint: this has no effect: the scene has no surface\n");
}

#[test]
fn wind_without_drag_is_applied_with_a_hint() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "spring-cloth", "--paused"]);
    let without = run(&sandbox, "ctl set wind.velocity 3 0 0");
    assert_eq!(without.code, Some(0));
    assert!(without.stderr.starts_with("hint: this has no effect while wind.drag is 0"));
    run(&sandbox, "ctl set wind.drag 0.5").success();
    assert_eq!(run(&sandbox, "ctl set wind.velocity 4 0 0").stderr, "");
}

#[test]
fn friction_without_contacts_is_applied_with_a_hint() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let without = run(&sandbox, "ctl set contact.friction 0.5");
    assert_eq!((without.code, without.stdout.as_str()), (Some(0), "applied at step 1\n"));
    let hint = "hint: this has no effect while contact.thickness is off (see `ctl set contact.thickness`)\n";
    assert_eq!(without.stderr, hint);
    run(&sandbox, "ctl set contact.thickness 0.02").success();
    assert_eq!(run(&sandbox, "ctl set contact.friction 0.4").stderr, "");
}

#[test]
fn a_value_behind_an_equals_sign_is_refused_with_the_cure() {
    let refused = run(&Sandbox::new(), "ctl set damping=3");
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""));
    let cure = "as in `ctl set damping 3` (allowed: a number >= 0, or off for 0)";
    assert!(refused.stderr.contains(cure), "{}", refused.stderr);
}

#[test]
fn a_query_of_an_unused_domain_leaves_it_without_files() {
    let sandbox = Sandbox::new();
    let refused = run(&sandbox, "ctl status");
    let expected = format!(
        "error: no node runs as 'sim' in domain '{0}': no program uses this domain; start one with \
         `sim-node run --domain {0}`, or name a running one with --domain and --name\n",
        sandbox.domain()
    );
    assert_eq!((refused.code, refused.stderr), (Some(1), expected));
    assert!(!sandbox.root().exists());
}

#[test]
fn get_shows_the_parameters_as_they_were_set() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    ctl(&sandbox, &["set", "gravity", "0", "-1.5", "0"]);
    ctl(&sandbox, &["set", "compliance", "0.001", "--kind", "bend"]);
    let all = ctl(&sandbox, &["get"]);
    assert_eq!(all["gravity"], serde_json::json!([0.0, -1.5, 0.0]));
    assert!(all["step"] == 1 && all["tear_force"].is_null(), "{all}");
    let one = ctl(&sandbox, &["get", "substeps"]);
    assert_eq!(one.as_object().unwrap().len(), 2, "{one}");
    let table = run(&sandbox, "ctl get gravity").success();
    assert_eq!(
        table,
        "since step 1\nparameter  constraints  value     unit\ngravity                 0 -1.5 0  m/s²\n"
    );
    // The curtain has colliders, which are published with their friction.
    ctl(&sandbox, &["step", "3"]);
    let step = ctl(&sandbox, &["set", "friction", "0.3"])["step"].as_u64().unwrap();
    ctl(&sandbox, &["step"]);
    let friction = run(&sandbox, "ctl get friction").success();
    assert!(friction.starts_with(&format!("since step {step}\n")), "{friction}");
    let unknown = run(&sandbox, "ctl get colour");
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("(allowed: gravity, damping, "), "{}", unknown.stderr);
}

#[test]
fn name_and_domain_are_accepted_before_the_subcommand() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "rope", "--paused", "--name", "left"]);
    let line = ["--domain", sandbox.domain(), "--name", "left", "ctl", "hash", "--json"];
    let found = Process::start_in(Program::SimNode, "elsewhere", &line).wait().json();
    assert_eq!(found["step"], 0);
}

#[test]
fn all_programs_blame_the_environment_for_a_bad_domain_in_it() {
    for (program, args) in [
        (Program::SimNode, &["run", "rope", "--steps", "1"][..]),
        (Program::SimNode, &["ctl", "status"]),
        (Program::Recorder, &["record", "-o", "never.mcap"]),
        (Program::ViewerBridge, &["--listen", "127.0.0.1:0"]),
        (Program::Watch, &[]),
    ] {
        let finished = Process::start_in(program, "Big Lab", args).wait();
        assert_eq!(finished.code, Some(1), "{program:?}: {}", finished.stderr);
        let blamed = "the environment variable CATENARY_DOMAIN is 'Big Lab', which is not a valid \
                      domain (allowed: 1 to 24 characters of a-z, 0-9, '_', '-')";
        assert!(finished.stderr.contains(blamed), "{program:?}: {}", finished.stderr);
        assert!(!finished.stderr.contains("--domain"), "{program:?}: {}", finished.stderr);
    }
}

#[test]
fn import_names_the_option_that_replaces_an_existing_file() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let scene = sandbox.write("scene.toml", "version = 1\n");
    let refused = run(&sandbox, &format!("import {mesh} -o {scene}"));
    assert_eq!(
        (refused.code, refused.stderr),
        (Some(1), format!("error: {scene} exists (use --overwrite to replace it)\n"))
    );
    // Importing replaces the file as a whole: a second name keeps the old contents.
    let old = sandbox.path("old.toml");
    std::fs::hard_link(&scene, &old).unwrap();
    run(&sandbox, &format!("import {mesh} -o {scene} --overwrite")).success();
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "version = 1\n");
    assert!(std::fs::read_to_string(&scene).unwrap().starts_with("# Converted from mesh.obj"));
}

#[test]
fn import_refuses_an_output_that_is_not_a_file() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for options in ["", " --overwrite"] {
        let refused = run(&sandbox, &format!("import {mesh} -o /dev/null{options}"));
        let expected = "error: /dev/null is a device; name a file\n".to_owned();
        assert_eq!((refused.code, refused.stderr), (Some(1), expected));
    }
}

#[test]
fn import_names_a_broken_mesh_once() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("mesh.obj", "v 0 0\nf 1 2 3\n");
    let refused = run(&sandbox, &format!("import {mesh}"));
    assert_eq!(refused.code, Some(1));
    assert_eq!(refused.stderr.matches("mesh.obj").count(), 1, "{}", refused.stderr);
    let refused = run(&sandbox, &format!("import {mesh} --bend nan"));
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("it must be a number from 0 to 1e20"), "{}", refused.stderr);
}

#[test]
fn a_mesh_in_another_format_is_named_by_every_command_that_reads_it() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.path("model.obj");
    let collider = "version = 1\n[[collider]]\nshape = \"mesh\"\npath = \"model.obj\"\n";
    let scene = sandbox.write("scene.toml", collider);
    for (content, format) in [
        (&b"glTF\x02\0\0\0\xff\xfe"[..], "a glTF file (binary)"),
        (b"{ \"asset\": { \"version\": \"2.0\" } }", "a glTF file (JSON)"),
        (b"#usda 1.0\n", "a USD file (text)"),
        (b"ply\nformat ascii 1.0\n", "a PLY file"),
    ] {
        std::fs::write(&mesh, content).unwrap();
        let expected =
            format!("it is {format}; only Wavefront OBJ is read: export the mesh in that format");
        for line in [format!("import {mesh}"), format!("check {scene}")] {
            let refused = run(&sandbox, &line);
            assert_eq!(refused.code, Some(1), "{line}");
            assert!(refused.stderr.contains(&expected), "{line}: {}", refused.stderr);
        }
    }
}

#[test]
fn a_table_can_be_appended_to_an_imported_mesh_and_to_a_shown_scene() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for line in [format!("import {mesh}"), "show curtain".to_owned()] {
        let text = run(&sandbox, &line).success();
        for table in [
            "[[particle]]\nposition = [0, 0, 0]\n",
            "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = -9\n",
            "[[anchor]]\nparticles = [1]\n",
        ] {
            let scene = sandbox.write("scene.toml", &format!("{text}{table}"));
            run(&sandbox, &format!("check {scene}")).success();
        }
    }
}

#[test]
fn import_says_which_densities_and_pins_it_accepts() {
    let sandbox = Sandbox::new();
    let mesh = sandbox.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let pins = "(allowed: none, 'y > 1.9', 'x < 0 and y >= 1', 'group NAME')";
    for (options, expected) in [
        ("--density 0", "(allowed: a number > 0)"),
        ("--pin [0,1]", pins),
        ("--pin up", pins),
        ("--pin y>high", pins),
    ] {
        let refused = run(&sandbox, &format!("import {mesh} {options}"));
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{options}");
        assert!(refused.stderr.contains(expected), "{}", refused.stderr);
    }
    let large = sandbox.write("large.obj", "v 0 0 0\nv 100 0 0\nv 0 145 0\nf 1 2 3\n");
    let warning = run(&sandbox, &format!("import {large}")).stderr;
    assert!(warning.contains("give a mesh in another unit --scale, such as 0.01 "), "{warning}");
    assert_eq!(run(&sandbox, &format!("import {large} --scale 0.01")).stderr, "");
    let unpinned = run(&sandbox, &format!("import {mesh} --pin y>5"));
    assert_eq!(unpinned.code, Some(0));
    assert_eq!(
        unpinned.stderr,
        "warning: --pin matches no particle of the shape (x 0 to 1, y 0 to 1, z 0 to 0)\n"
    );
}
