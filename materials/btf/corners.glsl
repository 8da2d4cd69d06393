// Which four texels lie about a point, and what each counts; `size` says how many there are.

ivec2 corner_at(ivec2 first, int corner) {
    ivec2 at = first + ivec2(corner & 1, corner >> 1);
    return at - size * ivec2(floor(vec2(at) / vec2(size)));
}

float share_of(vec2 part, int corner) {
    vec2 share = mix(1.0 - part, part, vec2(corner & 1, corner >> 1));
    return share.x * share.y;
}
