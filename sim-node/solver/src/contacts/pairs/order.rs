//! The order in which contacts are resolved.

/// Returns 8 bits that look random, so that neighbouring contacts are far from each other in the order. In the
/// order of the particles, a push would run through a stack in one direction.
pub(crate) fn order_key(low: u32, high: u32) -> u8 {
    let mixed = low.wrapping_mul(0x9e37_79b1) ^ high.wrapping_mul(0x85eb_ca6b);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    (mixed >> 24) as u8
}

/// Sorts contacts by their keys into `ordered`. Those of one key keep their order.
pub(crate) fn order_by_key<T: Copy>(contacts: &[T], ordered: &mut Vec<T>, key: impl Fn(&T) -> u8) {
    let mut places = [0_usize; 257];
    for contact in contacts {
        places[usize::from(key(contact)) + 1] += 1;
    }
    for key in 0..256 {
        places[key + 1] += places[key];
    }
    ordered.clear();
    ordered.extend_from_slice(contacts);
    for contact in contacts {
        let place = &mut places[usize::from(key(contact))];
        ordered[*place] = *contact;
        *place += 1;
    }
}
