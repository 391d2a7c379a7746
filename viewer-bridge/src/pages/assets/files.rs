//! The table of the page's files.

/// Pairs each path with the content of the file. A missing file does not compile.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_bytes!(concat!("../../../web/", $path)).as_slice())),*]
    };
}

/// The files of the page: path and content.
pub(super) const FILES: &[(&str, &[u8])] = files![
    "app.css",
    "index.html",
    "js/geometry/camera.js",
    "js/geometry/math.js",
    "js/geometry/pick.js",
    "js/geometry/round.js",
    "js/gl/arrows.js",
    "js/gl/buffers.js",
    "js/gl/cloth.js",
    "js/gl/colliders.js",
    "js/gl/context.js",
    "js/gl/ground.js",
    "js/gl/planks.js",
    "js/gl/points.js",
    "js/gl/renderer.js",
    "js/gl/shaders.js",
    "js/gl/shadow-map.js",
    "js/gl/solids.js",
    "js/gl/sticks.js",
    "js/gl/theme.js",
    "js/legend/color-legend.js",
    "js/legend/force-legend.js",
    "js/legend/value-scan.js",
    "js/main.js",
    "js/net/commands.js",
    "js/net/messages.js",
    "js/net/socket.js",
    "js/net/wire.js",
    "js/panel/charts.js",
    "js/panel/csv.js",
    "js/panel/inspector.js",
    "js/panel/panel.js",
    "js/panel/parameters.js",
    "js/panel/plot.js",
    "js/panel/selection-plots.js",
    "js/panel/series.js",
    "js/panel/value-field.js",
    "js/state/emitter.js",
    "js/state/forces.js",
    "js/state/framing.js",
    "js/state/hanging.js",
    "js/state/inspection.js",
    "js/state/live-state.js",
    "js/state/quantity.js",
    "js/state/selection.js",
    "js/state/shapes.js",
    "js/state/simulation.js",
    "js/state/splits.js",
    "js/state/topology.js",
    "js/state/weave.js",
    "js/state/wishes.js",
    "js/timeline/live-track.js",
    "js/timeline/replay-track.js",
    "js/timeline/timeline-bar.js",
    "js/timeline/timeline.js",
    "js/tools/brush.js",
    "js/tools/cut.js",
    "js/tools/grab.js",
    "js/tools/input.js",
    "js/tools/pin.js",
    "js/tools/select.js",
    "js/tools/tool.js",
    "js/tools/view.js",
    "js/ui/banner.js",
    "js/ui/controls.js",
    "js/ui/dom.js",
    "js/ui/format.js",
    "js/ui/hud.js",
    "js/ui/keys.js",
    "js/ui/link.js",
    "js/ui/overlay.js",
    "js/ui/prompts.js",
    "js/ui/save.js",
    "js/ui/scene-menu.js",
    "js/ui/undo.js",
    "js/ui/units.js",
    "js/ui/views.js",
    "js/viewer.js",
];

/// Pairs the path of the picture of each scene with its content.
macro_rules! pictures {
    ($($name:literal),* $(,)?) => {
        &[$((
            concat!("pictures/", $name, ".png"),
            include_bytes!(concat!("../../../pictures/", $name, ".png")).as_slice(),
        )),*]
    };
}

/// The pictures of the built-in scenes: path and content.
pub(super) const PICTURES: &[(&str, &[u8])] = pictures![
    "carried-cloth",
    "coiled-rope",
    "covered-bust",
    "curtain",
    "drop-box",
    "drop-box-braced",
    "elastic-mesh",
    "flag",
    "folding-cloth",
    "free-fall",
    "pendulum",
    "ragdoll",
    "ragdolls-in-net",
    "rope",
    "rope-bridge",
    "spider-web",
    "spring-cloth",
    "tearable-cloth",
    "two-flags",
];
