//! The table of the page's files.

/// Pairs each path with the content of the file. A missing file does not compile.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../../../web/", $path)))),*]
    };
}

/// The files of the page: path and content.
pub(super) const FILES: &[(&str, &str)] = files![
    "app.css",
    "index.html",
    "js/banner.js",
    "js/camera.js",
    "js/charts.js",
    "js/commands.js",
    "js/controls.js",
    "js/dom.js",
    "js/emitter.js",
    "js/framing.js",
    "js/gl/buffers.js",
    "js/gl/cloth.js",
    "js/gl/colliders.js",
    "js/gl/context.js",
    "js/gl/ground.js",
    "js/gl/points.js",
    "js/gl/renderer.js",
    "js/gl/shaders.js",
    "js/gl/solids.js",
    "js/gl/sticks.js",
    "js/hanging.js",
    "js/hud.js",
    "js/input.js",
    "js/keys.js",
    "js/link.js",
    "js/main.js",
    "js/math.js",
    "js/messages.js",
    "js/overlay.js",
    "js/panel.js",
    "js/parameters.js",
    "js/pick.js",
    "js/plot.js",
    "js/socket.js",
    "js/state.js",
    "js/theme.js",
    "js/timeline-bar.js",
    "js/timeline.js",
    "js/tools.js",
    "js/topology.js",
    "js/viewer.js",
    "js/views.js",
    "js/wire.js",
];
