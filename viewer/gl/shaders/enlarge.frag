// Enlargement of an image along one axis, across or DOWN: cubic between pixel centres, with slopes that avoid overshoot
// (van Leer 1977), so that edges have no halos. Computed in the shader, since hardware filters have 8 fractional bits.

uniform sampler2D small;
uniform float scale;    // its pixels per target pixel

layout(location = 0) out vec4 canvas;

#ifdef DOWN
#define ALONG y
#define PLACE(number) ivec2(int(gl_FragCoord.x), clamp(number, 0, last))
#else
#define ALONG x
#define PLACE(number) ivec2(clamp(number, 0, last), int(gl_FragCoord.y))
#endif

vec4 slope(vec4 before, vec4 after) {
    vec4 least = min(0.5 * abs(before + after), 2.0 * min(abs(before), abs(after)));
    return vec4(greaterThan(before * after, vec4(0.0))) * sign(before) * least;
}

void main() {
    int last = textureSize(small, 0).ALONG - 1;
    float at = gl_FragCoord.ALONG * scale - 0.5, t = fract(at);
    int first = int(floor(at));
    vec4 b = texelFetch(small, PLACE(first), 0), c = texelFetch(small, PLACE(first + 1), 0), rise = c - b;
    // The slope beyond the border is that inside.
    vec4 leaving = slope(first < 1 ? rise : b - texelFetch(small, PLACE(first - 1), 0), rise);
    vec4 arriving = slope(rise, first + 2 > last ? rise : texelFetch(small, PLACE(first + 2), 0) - c);
    canvas = b + t * (leaving + t * (3.0 * rise - 2.0 * leaving - arriving + t * (leaving + arriving - 2.0 * rise)));
}
