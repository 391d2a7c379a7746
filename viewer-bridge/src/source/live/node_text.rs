//! Messages about the state of a live node.

use sim_contract::NodeStatus;

use crate::message::{Node, NodeState};

/// Describes a node that runs. `method` is that of the load on show.
pub(super) fn node_text(status: Option<&NodeStatus>, method: Option<&'static str>) -> Node {
    let Some(status) = status else {
        return Node {
            state: NodeState::Alive,
            text: "a node is running, but has not published its status yet".to_owned(),
            ..Node::default()
        };
    };
    Node {
        state: NodeState::Alive,
        text: String::new(),
        run_id: Some(format!("{:016x}", status.run_id)),
        scene: Some(status.scene_name()),
        method,
        rate_hz: status.rate_hz,
        is_paused: status.is_paused(),
        is_replay: status.is_replay(),
        time_scale: status.time_scale,
        process_id: Some(status.process_id),
    }
}
