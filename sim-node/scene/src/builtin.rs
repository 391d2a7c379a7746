//! The built-in scenes.

const SCENES: [(&str, &str); 20] = [
    ("drape", include_str!("../scenes/drape.toml")),
    ("curtain", include_str!("../scenes/curtain.toml")),
    ("rope", include_str!("../scenes/rope.toml")),
    ("flag", include_str!("../scenes/flag.toml")),
    ("ragdoll", include_str!("../scenes/ragdoll.toml")),
    ("spider-web", include_str!("../scenes/spider-web.toml")),
    ("rope-bridge", include_str!("../scenes/rope-bridge.toml")),
    ("elastic-mesh", include_str!("../scenes/elastic-mesh.toml")),
    ("tearable-cloth", include_str!("../scenes/tearable-cloth.toml")),
    ("spring-cloth", include_str!("../scenes/spring-cloth.toml")),
    ("carried-cloth", include_str!("../scenes/carried-cloth.toml")),
    ("folding-cloth", include_str!("../scenes/folding-cloth.toml")),
    ("covered-bust", include_str!("../scenes/covered-bust.toml")),
    ("coiled-rope", include_str!("../scenes/coiled-rope.toml")),
    ("two-flags", include_str!("../scenes/two-flags.toml")),
    ("ragdolls-in-net", include_str!("../scenes/ragdolls-in-net.toml")),
    ("drop-box", include_str!("../scenes/drop-box.toml")),
    ("drop-box-braced", include_str!("../scenes/drop-box-braced.toml")),
    ("pendulum", include_str!("../scenes/pendulum.toml")),
    ("free-fall", include_str!("../scenes/free-fall.toml")),
];

/// Returns the names of the built-in scenes, in the order of listings.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// Returns the TOML text of a built-in scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// Returns a description of a built-in scene in one line: the first comment line of its text.
pub fn summary(name: &str) -> Option<&'static str> {
    text(name)?.lines().next().map(|line| line.trim_start_matches(['#', ' ']))
}
