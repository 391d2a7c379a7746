//! Names of recordings. A page never chooses a path: the bridge names what it writes, and opens only names
//! in its own folder.

use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};
use std::{fs, io};

use sim_host::part_path;

use crate::limits::RECORDINGS_LISTED_MAX;

/// Longest part of a name that comes from the scene.
const SCENE_LENGTH_MAX: usize = 48;
/// Longest name that is opened.
const NAME_LENGTH_MAX: usize = 128;
/// Ending of the files.
const ENDING: &str = "mcap";

fn is_plain(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '-' || letter == '_'
}

/// Returns a path in the folder that no recording has: the scene and the time in UTC, and a number if
/// that is taken.
pub(crate) fn free_path(folder: &Path, scene: &str, now_ns: u64) -> PathBuf {
    let scene: String = scene.chars().take(SCENE_LENGTH_MAX).collect();
    let scene = scene.replace(|letter| !is_plain(letter), "-");
    let scene = if scene.is_empty() { "recording" } else { &scene };
    let now = UNIX_EPOCH + Duration::from_nanos(now_ns);
    let time = humantime::format_rfc3339_seconds(now).to_string().replace(':', "-");
    let mut path = folder.join(format!("{scene}_{time}.{ENDING}"));
    let mut number = 1_u32;
    while path.exists() || part_path(&path).exists() {
        number += 1;
        path.set_file_name(format!("{scene}_{time}_{number}.{ENDING}"));
    }
    path
}

/// Returns the name under which a page opens a recording.
pub(crate) fn name_of(path: &Path) -> Option<String> {
    path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned)
}

/// Returns whether `name` is a valid name of a recording: a single path component that is not hidden.
fn is_name(name: &str) -> bool {
    let is_allowed = |letter: char| !letter.is_control() && letter != '/' && letter != '\\';
    !name.is_empty()
        && name.len() <= NAME_LENGTH_MAX
        && !name.starts_with('.')
        && name.chars().all(is_allowed)
}

/// Returns the path of the recording `name` in the folder; `None` if the name is not valid.
pub(crate) fn path_of(folder: &Path, name: &str) -> Option<PathBuf> {
    is_name(name).then(|| folder.join(format!("{name}.{ENDING}")))
}

/// Returns the names of the recordings in a folder, newest first. Empty if the folder cannot be read.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == ENDING))
        .filter_map(|path| {
            let metadata = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?;
            Some((metadata.modified().ok()?, name_of(&path).filter(|name| is_name(name))?))
        })
        .collect();
    found.sort_unstable_by(|a, b| b.cmp(a));
    found.truncate(RECORDINGS_LISTED_MAX);
    found.into_iter().map(|(_, name)| name).collect()
}

/// Returns the newest recording in a folder.
///
/// # Errors
/// The folder cannot be read.
pub fn newest_recording(folder: &Path) -> io::Result<Option<PathBuf>> {
    fs::read_dir(folder)?;
    Ok(names_in(folder).first().and_then(|name| path_of(folder, name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOON_NS: u64 = 1_764_072_000_000_000_000;

    #[test]
    fn a_recording_is_named_by_its_scene_and_time_and_never_leaves_the_folder() {
        let folder = Path::new("/nowhere");
        let name = |scene: &str| free_path(folder, scene, NOON_NS).display().to_string();
        assert_eq!(name("curtain"), "/nowhere/curtain_2025-11-25T12-00-00Z.mcap");
        assert_eq!(name(""), "/nowhere/recording_2025-11-25T12-00-00Z.mcap");
        assert_eq!(name("../../a b"), "/nowhere/------a-b_2025-11-25T12-00-00Z.mcap");
        assert!(name(&"x".repeat(500)).len() < 100);
        let path = free_path(folder, "rope", NOON_NS);
        assert_eq!(path_of(folder, &name_of(&path).unwrap()), Some(path));
    }

    #[test]
    fn a_name_that_is_taken_gets_a_number() {
        let folder = std::env::temp_dir().join(format!("catenary-names-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let first = free_path(&folder, "rope", NOON_NS);
        fs::write(part_path(&first), "").unwrap();
        let second = free_path(&folder, "rope", NOON_NS);
        fs::write(&second, "").unwrap();
        let third = free_path(&folder, "rope", NOON_NS);
        fs::remove_dir_all(&folder).unwrap();
        assert!(second.ends_with("rope_2025-11-25T12-00-00Z_2.mcap"), "{second:?}");
        assert!(third.ends_with("rope_2025-11-25T12-00-00Z_3.mcap"), "{third:?}");
    }

    #[test]
    fn only_names_within_the_folder_are_opened() {
        let folder = Path::new("/nowhere");
        for name in ["", ".", "..", ".a", "../a", "a/b", "a\\b", "a\nb", "\u{0}", &"x".repeat(129)]
        {
            assert_eq!(path_of(folder, name), None, "{name:?}");
        }
        for name in ["a", "a b", "a.2", "é", "a..b"] {
            assert_eq!(path_of(folder, name), Some(folder.join(format!("{name}.mcap"))));
        }
    }

    #[test]
    fn recordings_are_listed_newest_first_and_nothing_else_is() {
        let folder = std::env::temp_dir().join(format!("catenary-list-{}", std::process::id()));
        fs::create_dir_all(folder.join("folder.mcap")).unwrap();
        let begin = UNIX_EPOCH + Duration::from_hours(490_020);
        for (age_s, name) in
            [(3, "old.mcap"), (1, "é 2.mcap"), (2, "b.mcap"), (0, "c.mcap.part"), (0, ".d.mcap")]
        {
            let file = fs::File::create(folder.join(name)).unwrap();
            file.set_modified(begin - Duration::from_secs(age_s)).unwrap();
        }
        let (names, newest) = (names_in(&folder), newest_recording(&folder).unwrap());
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(names, ["é 2", "b", "old"]);
        assert_eq!(newest, Some(folder.join("é 2.mcap")));
        assert_eq!(names_in(&folder), Vec::<String>::new());
        assert!(newest_recording(&folder).is_err());
    }
}
