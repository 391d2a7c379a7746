//! The files of an export: their names, and their removal if one of them fails.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use recording::pictures::{Picture, encode_png, encode_svg};
use recording::{Existing, PartFile};
use sim_host::{console, explain_write_error};

/// A file that keeps the first error of writing, which a format may wrap or take for one of its input.
struct ObservedFile<'a> {
    file: &'a mut PartFile,
    failure: Option<String>,
}

impl ObservedFile<'_> {
    fn observe<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &result
            && error.kind() != io::ErrorKind::Interrupted
        {
            self.failure.get_or_insert_with(|| explain_write_error(error));
        }
        result
    }
}

impl Write for ObservedFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.file.write(bytes);
        self.observe(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.flush();
        self.observe(result)
    }
}

/// Returns `true` for the path `-`, which is stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Stdout, which notes that its reader wants no more.
struct ResultStream<'a> {
    is_closed: &'a mut bool,
}

impl Write for ResultStream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        *self.is_closed |= !console::write_part(bytes)?;
        if *self.is_closed { Err(io::ErrorKind::BrokenPipe.into()) } else { Ok(bytes.len()) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes a file to stdout. A pipe whose reader has gone ends it quietly.
fn write_to_stdout(write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let mut is_closed = false;
    let mut out = BufWriter::with_capacity(1 << 16, ResultStream { is_closed: &mut is_closed });
    let result = write(&mut out).and_then(|()| out.flush().context("cannot write to stdout"));
    // What is left in the buffer after an error is dropped.
    let (_stream, _rest) = out.into_parts();
    if is_closed { Ok(()) } else { result }
}

/// The files that an export has written so far.
#[derive(Debug)]
pub(crate) struct WrittenFiles {
    existing: Existing,
    paths: Vec<PathBuf>,
}

impl WrittenFiles {
    pub(crate) fn new(existing: Existing) -> Self {
        Self { existing, paths: Vec::new() }
    }

    pub(crate) fn existing(&self) -> Existing {
        self.existing
    }

    pub(crate) fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Writes a file from its whole content.
    pub(crate) fn add_whole(&mut self, path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
        PartFile::write_whole(path, self.existing, bytes)?;
        self.paths.push(path.to_owned());
        Ok(())
    }

    /// Writes a file piece by piece. It gets its name only when it is complete. The path `-` is stdout.
    pub(crate) fn add_streamed(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        if is_stdout(path) {
            self.paths.push(path.to_owned());
            return write_to_stdout(write);
        }
        let mut file = PartFile::create(path, self.existing)?;
        let mut observed = ObservedFile { file: &mut file, failure: None };
        if let Err(error) = write(&mut observed) {
            let failure = observed.failure.map(|text| {
                let part_path = file.part_path().display();
                anyhow!("cannot write {part_path}: {text}")
            });
            file.discard()?;
            return Err(failure.unwrap_or(error));
        }
        self.paths.push(file.finish()?);
        Ok(())
    }

    /// Removes the files, so that nothing of an incomplete export is left.
    pub(crate) fn remove(self) {
        for path in self.paths.iter().filter(|path| !is_stdout(path)) {
            // An error of the export is reported already, and is more important.
            _ = fs::remove_file(path);
        }
    }
}

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

/// The folder and the format of the pictures.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    names: FrameNames<'a>,
    format: PictureFormat,
    existing: Existing,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Png,
    Svg,
}

impl<'a> Target<'a> {
    pub(crate) fn new(
        folder: &'a Path,
        format: PictureFormat,
        existing: Existing,
        scene_name: &str,
    ) -> Self {
        let extension = match format {
            PictureFormat::Png => "png",
            PictureFormat::Svg => "svg",
        };
        Self { names: FrameNames::new(folder, scene_name, extension), format, existing }
    }

    /// Creates the folder, or empties it of older pictures. Fails if one of the files may not be created.
    pub(crate) fn prepare(&self, steps: &[u64]) -> anyhow::Result<()> {
        self.names.prepare(steps, self.existing)?;
        self.names.remove_older(self.existing)
    }

    /// Writes the picture of a step. The file gets its name only when it is complete.
    pub(crate) fn write(&self, step: u64, picture: &Picture) -> anyhow::Result<PathBuf> {
        let bytes = match self.format {
            PictureFormat::Png => encode_png(picture)?,
            PictureFormat::Svg => encode_svg(picture).into_bytes(),
        };
        let path = self.names.path(step);
        PartFile::write_whole(&path, self.existing, &bytes)?;
        Ok(path)
    }
}

#[cfg(test)]
mod frame_names_tests {
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
