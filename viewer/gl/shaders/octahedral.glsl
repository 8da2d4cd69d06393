// Octahedral mapping of directions to [-1, 1]^2, up at the centre, down at the corners; twin of
// lighting.environment.octahedral.

const float PI = 3.14159265358979;

vec2 octahedral(vec3 to) {
    vec3 on = to / (abs(to.x) + abs(to.y) + abs(to.z));
    vec2 folded = vec2((1.0 - abs(on.z)) * (on.x < 0.0 ? -1.0 : 1.0), (1.0 - abs(on.x)) * (on.z < 0.0 ? -1.0 : 1.0));
    return on.y < 0.0 ? folded : on.xz;
}
