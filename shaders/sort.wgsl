// SORT: a bitonic sort (K. E. Batcher, "Sorting Networks and their Applications", 1968) of keys by depth, and by their places where depths are the same: no
// two keys are, so that the order is one and the same in every frame. Steps that stay within a block are done in shared memory at once.
// variants: LOCAL
// counts: 2; with LOCAL 1

struct Push {
    // Edges of the sorted runs that this makes: from the first to the last, each twice the one before.
    first: u32,
    last: u32,
    // Distance between the keys of a pair, for a dispatch of a single step.
    apart: u32,
}

var<immediate> push: Push;

@group(0) @binding(0) var<storage, read_write> keys: array<vec2<u32>>;

// Keys of a block.
const BLOCK: u32 = 2048u; // host
const THREADS: u32 = 128u;

fn is_after(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.x > b.x || (a.x == b.x && a.y > b.y);
}

// The first key of a pair: a number with a zero put in at the bit of the distance.
fn first_of(pair: u32, apart: u32) -> u32 {
    return ((pair & ~(apart - 1u)) << 1u) | (pair & (apart - 1u));
}

#ifdef LOCAL

var<workgroup> block: array<vec2<u32>, BLOCK>;

@compute @workgroup_size(128, 1, 1)
fn main(@builtin(local_invocation_index) thread: u32, @builtin(workgroup_id) group: vec3<u32>) {
    let start = group.x * BLOCK;
    for (var i = thread; i < BLOCK; i += THREADS) {
        block[i] = keys[start + i];
    }
    workgroupBarrier();
    for (var run = push.first; run <= push.last; run = run << 1u) {
        for (var apart = min(run, BLOCK) >> 1u; apart > 0u; apart = apart >> 1u) {
            for (var pair = thread; pair < BLOCK / 2u; pair += THREADS) {
                let low = first_of(pair, apart);
                let high = low + apart;
                let rises = ((start + low) & run) == 0u;
                let a = block[low];
                let b = block[high];
                if is_after(a, b) == rises {
                    block[low] = b;
                    block[high] = a;
                }
            }
            workgroupBarrier();
        }
    }
    for (var i = thread; i < BLOCK; i += THREADS) {
        keys[start + i] = block[i];
    }
}

#else

@compute @workgroup_size(128, 1, 1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let low = first_of(id.x, push.apart);
    let high = low + push.apart;
    let rises = (low & push.last) == 0u;
    let a = keys[low];
    let b = keys[high];
    if is_after(a, b) == rises {
        keys[low] = b;
        keys[high] = a;
    }
}

#endif
