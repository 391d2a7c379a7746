//! Files with one snapshot each, named after the scene and the step.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::Existing;

/// Most files of one call. A higher number is probably a mistake.
const FILES_MAX: usize = 10_000;

/// The folder and the names of the files.
#[derive(Debug)]
pub(crate) struct FrameNames<'a> {
    folder: &'a Path,
    /// The name of the scene, reduced to characters that are safe in a file name.
    stem: String,
    extension: &'static str,
}

impl<'a> FrameNames<'a> {
    pub(crate) fn new(folder: &'a Path, scene_name: &str, extension: &'static str) -> Self {
        Self { folder, stem: stem(scene_name), extension }
    }

    /// Returns the name of the file of a step, without its folder.
    pub(crate) fn name(&self, step: u64) -> String {
        format!("{}_{step:08}.{}", self.stem, self.extension)
    }

    pub(crate) fn path(&self, step: u64) -> PathBuf {
        self.folder.join(self.name(step))
    }

    /// Returns the path of a file for all steps.
    pub(crate) fn index_path(&self, extension: &str) -> PathBuf {
        self.folder.join(format!("{}.{extension}", self.stem))
    }

    /// Creates the folder. Fails if one of the files may not be created.
    pub(crate) fn prepare(&self, steps: &[u64], existing: Existing) -> anyhow::Result<()> {
        let folder = self.folder;
        if steps.len() > FILES_MAX {
            let count = steps.len();
            bail!(
                "the options select {count} snapshots, one file each (allowed: up to {FILES_MAX}). \
                 Select fewer, such as with --every 20ms"
            );
        }
        if folder.exists() && !folder.is_dir() {
            bail!("{} is not a folder; name a folder for the files", folder.display());
        }
        steps.iter().try_for_each(|step| existing.check(&self.path(*step)))?;
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the folder {}", folder.display()))
    }

    /// Removes the files of other steps that an earlier export has left in the folder, if files may be
    /// replaced. Only files with such a name are removed.
    pub(crate) fn remove_older(&self, existing: Existing) -> anyhow::Result<()> {
        if existing != Existing::Overwrite {
            return Ok(());
        }
        let folder = self.folder;
        let reading = || format!("cannot read the folder {}", folder.display());
        for entry in fs::read_dir(folder).with_context(reading)? {
            let entry = entry.with_context(reading)?;
            let is_file = entry.file_type().with_context(reading)?.is_file();
            if is_file && entry.file_name().to_str().is_some_and(|name| self.is_frame(name)) {
                let path = entry.path();
                fs::remove_file(&path).with_context(|| {
                    format!("cannot remove {} of an earlier export", path.display())
                })?;
            }
        }
        Ok(())
    }

    /// Returns `true` for the name of the file of any step.
    fn is_frame(&self, name: &str) -> bool {
        let step = name
            .strip_prefix(&self.stem)
            .and_then(|rest| rest.strip_prefix('_'))
            .and_then(|rest| rest.strip_suffix(self.extension))
            .and_then(|rest| rest.strip_suffix('.'));
        step.and_then(|step| step.parse().ok()).is_some_and(|step| self.name(step) == name)
    }
}

/// Returns the name of a scene with every character that is not safe in a file name replaced.
fn stem(name: &str) -> String {
    let is_safe = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
    let stem: String =
        name.chars().map(|letter| if is_safe(letter) { letter } else { '_' }).collect();
    if stem.trim_matches('.').is_empty() { "scene".to_owned() } else { stem }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_after_the_scene() {
        let name = |scene: &str| FrameNames::new(Path::new("d"), scene, "png").path(37);
        assert_eq!(name("curtain"), Path::new("d/curtain_00000037.png"));
        assert_eq!(name("../a b"), Path::new("d/.._a_b_00000037.png"));
        assert_eq!(name(".."), Path::new("d/scene_00000037.png"));
    }

    #[test]
    fn only_files_of_an_earlier_export_of_the_same_scene_and_format_are_removed() {
        let folder =
            std::env::temp_dir().join(format!("recorder-older-frames-{}", std::process::id()));
        fs::create_dir_all(folder.join("rope_00000009.png")).unwrap();
        let (older, others) = (
            ["rope_00000000.png", "rope_00000480.png", "rope_123456789.png"],
            [
                "rope_480.png",
                "rope_0000048x.png",
                "rope_+0000480.png",
                "rope_00000480.svg",
                "rope_2_00000480.png",
                "curtain_00000480.png",
                "rope.png",
            ],
        );
        let write = || {
            for name in older.iter().chain(&others) {
                fs::write(folder.join(name), "").unwrap();
            }
        };
        let names = FrameNames::new(&folder, "rope", "png");
        write();
        names.remove_older(Existing::Refuse).unwrap();
        assert!(older.iter().all(|name| folder.join(name).exists()));
        names.remove_older(Existing::Overwrite).unwrap();
        let mut left: Vec<_> = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        fs::remove_dir_all(&folder).unwrap();
        let mut expected = [&others[..], &["rope_00000009.png"]].concat();
        left.sort();
        expected.sort_unstable();
        assert_eq!(left, expected);
    }

    #[test]
    fn too_many_files_are_refused() {
        let steps: Vec<u64> = (0..20_000).collect();
        let names = FrameNames::new(Path::new("/nonexistent/folder"), "rope", "png");
        let error = names.prepare(&steps, Existing::Refuse).unwrap_err().to_string();
        assert!(error.starts_with("the options select 20000 snapshots, one file each"), "{error}");
    }
}
