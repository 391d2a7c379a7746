//! Hints on applied commands that change nothing visible.

use std::time::Duration;

use sim_contract::{Action, Client, Parameter};

/// Explains an applied command that changes nothing visible.
pub(super) fn for_applied(
    client: &mut Client,
    timeout: Duration,
    action: &Action,
) -> Option<&'static str> {
    let Action::Set { parameter, .. } = action else { return None };
    match Parameter::from_name(parameter.as_str())? {
        Parameter::WindVelocity => for_wind(client, timeout),
        Parameter::ContactFriction => {
            let values = client.parameters(timeout).ok()??.values;
            let is_off = values.optional(Parameter::ContactThickness).is_none();
            is_off.then_some(
                "this has no effect while contact.thickness is off (see `ctl set contact.thickness`)",
            )
        }
        _ => None,
    }
}

/// Without an answer of the node there is no hint; the command was applied all the same.
fn for_wind(client: &mut Client, timeout: Duration) -> Option<&'static str> {
    if client.surface(timeout).ok()??.triangles.is_empty() {
        return Some("this has no effect: the scene has no surface");
    }
    let is_still = client.parameters(timeout).ok()??.values.number(Parameter::WindDrag) == 0.0;
    is_still.then_some("this has no effect while wind.drag is 0 (see `ctl set wind.drag`)")
}
