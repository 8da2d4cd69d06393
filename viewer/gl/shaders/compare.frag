// Comparison of two images over their surround, in XYZ adapted to the display's white: ONE of them, parts of TWO, or
// the MAP of their differences. These are separate programs, since software GL evaluates all branches at every pixel.

uniform sampler2D first;        // XYZ and coverage of A, or of the only image
uniform sampler2D second;       // of B
uniform sampler2D differences;  // ΔE; -1 if not compared, infinite if invalid
uniform sampler2D scale;        // XYZ of the steps of ΔE, of larger values, and of invalid ones
uniform mat3 adapt_first, adapt_second;
uniform float exposure;
uniform vec3 surround;
uniform int mode;               // of two
uniform float position;         // of the wipe, pixels
uniform int cell;               // of the checkerboard, pixels
uniform float largest;          // ΔE at the end of the scale
uniform float tolerance;        // ΔE of the contour; negative for none
uniform vec3 contour;

layout(location = 0) out vec4 xyz_d65;

vec3 no_number() { return texelFetch(scale, ivec2(textureSize(scale, 0).x - 1, 0), 0).xyz; }

vec3 over_surround(vec4 found, mat3 adapt) {
    vec3 xyz = adapt * found.xyz * exposure + (1.0 - found.w) * surround;
    return any(isnan(xyz)) || any(isinf(xyz)) ? no_number() : xyz;
}

#ifdef MAP
vec3 mapped(ivec2 at) {
    float difference = texelFetch(differences, at, 0).x;
    if (difference < 0.0) return surround;
    if (isinf(difference)) return no_number();
    if (tolerance >= 0.0 && difference <= tolerance) {
        ivec2 last = textureSize(differences, 0) - 1;
        for (int side = 0; side < 4; ++side) {
            ivec2 off = ivec2(side == 0 ? 1 : side == 1 ? -1 : 0, side == 2 ? 1 : side == 3 ? -1 : 0);
            if (texelFetch(differences, clamp(at + off, ivec2(0), last), 0).x > tolerance) return contour;
        }
    }
    int steps = textureSize(scale, 0).x - 2;
    int step = difference > largest ? steps : min(int(difference / largest * float(steps)), steps - 1);
    return texelFetch(scale, ivec2(step, 0), 0).xyz;
}
#endif

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#ifdef MAP
    vec3 xyz = mapped(at);
#else
    bool b = false;
#ifdef TWO
    if (mode == 2) b = gl_FragCoord.x >= position;
    if (mode == 3) {
        // Both sides show the centre of the image.
        int width = textureSize(first, 0).x, half_width = width / 2;
        b = at.x >= half_width;
        at.x += (b ? -half_width : 0) + (width - half_width) / 2;
    }
    if (mode == 4) b = (((at.x / cell) ^ (at.y / cell)) & 1) != 0;
    vec4 found = b ? texelFetch(second, at, 0) : texelFetch(first, at, 0);
#else
    vec4 found = texelFetch(first, at, 0);
#endif
    vec3 xyz = over_surround(found, b ? adapt_second : adapt_first);
#endif
    xyz_d65 = vec4(xyz, 1.0);
}
