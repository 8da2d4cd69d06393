// Display codes, striped where the display cannot show the colour: red above its range, blue outside its gamut, green
// below its black.

uniform sampler2D sent;       // codes of this display
uniform sampler2D limited;    // codes of the tested display before clipping
uniform sampler2D beyond;     // for displays with codes limited to the gamut: 1 below the range, 2 above, of 255
uniform bool tabled;          // whether to use `beyond` instead of codes
uniform sampler2D xyz;        // XYZ of the same
uniform float black;          // luminance of the tested display's black, far below zero without light
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
