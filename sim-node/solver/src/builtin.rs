//! The scenes that come with the programs.

const SCENES: [(&str, &str); 2] = [
    ("curtain", include_str!("../../scenes/curtain.toml")),
    ("rope", include_str!("../../scenes/rope.toml")),
];

/// The names of the built-in scenes, in the order in which they are listed.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// The TOML text of a built-in scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// What a built-in scene is, in one line: the first comment line of its text.
pub fn summary(name: &str) -> Option<&'static str> {
    text(name)?.lines().next().map(|line| line.trim_start_matches(['#', ' ']))
}
