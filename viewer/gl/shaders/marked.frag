// Codes that the display is sent, striped where a display cannot show them: red above its range, blue outside its gamut,
// green darker than its black.

uniform sampler2D sent;       // codes of this display
uniform sampler2D limited;    // codes of the display that is asked, as they are before it clips them
uniform sampler2D beyond;     // of a display whose codes end at its gamut: 1 below its range, 2 above, of 255
uniform bool tabled;          // whether `beyond` counts in place of codes
uniform sampler2D xyz;        // XYZ of the same
uniform float black;          // luminance of that display's black, far below zero where it has no light
uniform float tolerance;
uniform int stripe;           // pixels

layout(location = 0) out vec4 rgb;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 codes = texelFetch(limited, at, 0).rgb;
    bool above = any(greaterThan(codes, vec3(1.0 + tolerance))), below = any(lessThan(codes, vec3(-tolerance)));
    if (tabled) {
        int side = int(texelFetch(beyond, at, 0).r * 255.0 + 0.5);
        above = side == 2;
        below = side == 1;
    }
    int band = ((at.x + at.y) / stripe) % 4;
    rgb = vec4(texelFetch(sent, at, 0).rgb, 1.0);
    if (above && band == 0) rgb.rgb = vec3(1.0, 0.0, 0.0);
    if (below && band == 2) rgb.rgb = texelFetch(xyz, at, 0).y < black ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
}
