// A picture of fewer pixels, linearly between them: by hand, since hardware filters have 8 bits of fraction.

uniform sampler2D small;
uniform vec2 scale;     // its pixels for each of these

layout(location = 0) out vec4 canvas;

void main() {
    vec2 at = gl_FragCoord.xy * scale - 0.5;
    vec2 between = fract(at);
    ivec2 first = ivec2(floor(at)), last = textureSize(small, 0) - 1;
    ivec2 low = clamp(first, ivec2(0), last), high = clamp(first + 1, ivec2(0), last);
    canvas = mix(
        mix(texelFetch(small, low, 0), texelFetch(small, ivec2(high.x, low.y), 0), between.x),
        mix(texelFetch(small, ivec2(low.x, high.y), 0), texelFetch(small, high, 0), between.x), between.y);
}
