//! Configuration files of iceoryx2. They decide on iceoryx2's own domain, which is Catenary's default
//! domain. Named domains do not depend on them.

use std::path::{Path, PathBuf};

use sim_contract::{ConfigFile, ConfigFileError};

use super::finding::Finding;

const CHECK: &str = "iceoryx2.toml";

/// Returns the files that iceoryx2 looks for, in this order. The first valid one applies.
pub(super) fn candidates(home: Option<&Path>) -> Vec<PathBuf> {
    let of_user = home.map(|home| home.join(".config/iceoryx2/iceoryx2.toml"));
    let system = PathBuf::from("/etc/iceoryx2/iceoryx2.toml");
    [PathBuf::from("config/iceoryx2.toml")].into_iter().chain(of_user).chain([system]).collect()
}

/// The part of a domain that a configuration file can agree with.
#[derive(Debug)]
pub(super) struct Place {
    /// `None` is iceoryx2's own domain.
    pub(super) domain: Option<String>,
    pub(super) paths: ConfigFile,
}

/// Judges these files for a domain.
pub(super) fn check(files: &[PathBuf], place: &Place) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut applies = true;
    for path in files {
        match ConfigFile::read(path) {
            Ok(None) => {}
            Ok(Some(file)) => {
                findings.push(describe(path, &file, place, applies));
                applies = false;
            }
            Err(error) => findings.push(describe_invalid(path, &error)),
        }
    }
    if applies {
        findings.push(Finding::ok(CHECK, without_a_file(place)));
    }
    findings
}

fn describe(path: &Path, file: &ConfigFile, place: &Place, applies: bool) -> Finding {
    let name = path.display();
    if !applies {
        return Finding::note(
            CHECK,
            format!("{name} has no effect: iceoryx2 reads the file above"),
        );
    }
    let ConfigFile { prefix, root } = file;
    let paths = format!("prefix {prefix} and root {}", root.display());
    let is_equal = *prefix == place.paths.prefix && is_same(root, &place.paths.root);
    match &place.domain {
        None => Finding::note(
            CHECK,
            format!(
                "{name} decides on the default domain ({paths}): programs that are started elsewhere may \
                 not see it"
            ),
        )
        .with_cure("export CATENARY_DOMAIN=NAME"),
        Some(domain) if is_equal => {
            Finding::ok(CHECK, format!("with {name}, iox2 sees the services of domain '{domain}'"))
        }
        Some(domain) => Finding::note(
            CHECK,
            format!(
                "{name} does not matter to Catenary in domain '{domain}', but iox2 and other programs of \
                 iceoryx2 follow it ({paths}), so they do not see this domain"
            ),
        )
        .with_cure(print_config(domain)),
    }
}

/// Compares two folders; a slash at the end makes no difference.
fn is_same(one: &Path, other: &Path) -> bool {
    one.components().eq(other.components())
}

fn describe_invalid(path: &Path, error: &ConfigFileError) -> Finding {
    let text = format!("iceoryx2 ignores {}: {error}", path.display());
    Finding::problem(CHECK, text).with_cure(format!("rm {}", path.display()))
}

fn without_a_file(place: &Place) -> String {
    match &place.domain {
        None => "there is none, so iox2 sees the default domain".to_owned(),
        Some(domain) => format!(
            "there is none, so iox2 does not see domain '{domain}' (`{}` creates one)",
            print_config(domain)
        ),
    }
}

fn print_config(domain: &str) -> String {
    format!("sim-node doctor --domain {domain} --iox2-config > config/iceoryx2.toml")
}

/// A user of the system.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct User {
    /// Name, or the number of a user without one.
    pub(super) name: String,
    pub(super) home: Option<PathBuf>,
}

impl User {
    /// Finds a user in the text of `/etc/passwd`, where iceoryx2 looks for the home folder, too.
    pub(super) fn find(passwd: &str, id: u32) -> Self {
        let number = id.to_string();
        let fields = |line: &str| line.split(':').map(ToOwned::to_owned).collect::<Vec<_>>();
        let is_user = |fields: &Vec<String>| fields.get(2) == Some(&number);
        match passwd.lines().map(fields).find(is_user) {
            Some(fields) => {
                Self { name: fields[0].clone(), home: fields.get(5).map(PathBuf::from) }
            }
            None => Self { name: number, home: None },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::finding::Level;
    use super::*;

    /// A folder in the temporary directory, removed with everything in it.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new() -> Self {
            let path = std::env::temp_dir().join(format!("catenary-config-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn write(&self, name: &str, text: &str) -> PathBuf {
            let path = self.0.join(name);
            fs::write(&path, text).unwrap();
            path
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn place(domain: Option<&str>) -> Place {
        let paths = ConfigFile { prefix: "lab_".to_owned(), root: "/tmp/lab".into() };
        Place { domain: domain.map(ToOwned::to_owned), paths }
    }

    #[test]
    fn a_file_matters_to_the_default_domain_and_only_to_other_programs_otherwise() {
        let scratch = Scratch::new();
        let stray =
            scratch.write("stray.toml", "[global]\nprefix = \"x_\"\nroot-path = \"/tmp/x\"\n");
        let equal =
            scratch.write("equal.toml", "[global]\nprefix = \"lab_\"\nroot-path = \"/tmp/lab/\"\n");
        let broken = scratch.write("broken.toml", "[global\n");
        let missing = scratch.0.join("missing.toml");
        let lab = place(Some("lab"));
        let one =
            |path: &PathBuf, place: &Place| check(std::slice::from_ref(path), place).swap_remove(0);
        let own = one(&stray, &place(None));
        assert_eq!(own.level, Level::Note);
        assert!(own.text.contains("decides on the default domain (prefix x_ and root /tmp/x)"));
        let named = one(&stray, &lab);
        assert_eq!(named.level, Level::Note);
        assert!(
            named.text.contains("does not matter to Catenary in domain 'lab'"),
            "{}",
            named.text
        );
        assert!(named.cure.unwrap().contains("--domain lab --iox2-config"));
        assert_eq!(one(&equal, &lab).level, Level::Ok);
        assert_eq!(one(&missing, &lab).level, Level::Ok);
        assert!(one(&missing, &lab).text.contains("does not see domain 'lab'"));
        assert_eq!(one(&broken, &lab).level, Level::Problem);
        // An invalid file does not hide the next one, and a valid one does.
        let levels: Vec<_> =
            check(&[broken, equal, stray], &lab).into_iter().map(|one| one.level).collect();
        assert_eq!(levels, [Level::Problem, Level::Ok, Level::Note]);
    }

    #[test]
    fn iceoryx2_looks_in_the_current_folder_at_home_and_in_etc() {
        let files = candidates(Some(Path::new("/home/ada")));
        assert_eq!(files[0], Path::new("config/iceoryx2.toml"));
        assert_eq!(files[1], Path::new("/home/ada/.config/iceoryx2/iceoryx2.toml"));
        assert_eq!(files[2], Path::new("/etc/iceoryx2/iceoryx2.toml"));
        assert_eq!(candidates(None).len(), 2);
    }

    #[test]
    fn a_user_is_found_by_number_and_an_unknown_one_has_no_home() {
        let passwd =
            "root:x:0:0:root:/root:/bin/sh\nada:x:1000:1000::/home/ada:/bin/sh\nshort:x:1\n";
        let user = |name: &str, home: Option<&str>| User {
            name: name.to_owned(),
            home: home.map(PathBuf::from),
        };
        assert_eq!(User::find(passwd, 1000), user("ada", Some("/home/ada")));
        assert_eq!(User::find(passwd, 1), user("short", None));
        assert_eq!(User::find(passwd, 7), user("7", None));
    }
}
