// Copy of a window to its place in the image: unchanged, with its coverage, or the coverage alone (of an image: ALPHA).

#ifdef PICTURE
uniform sampler2D picture;
#endif
#ifdef COVERAGE
uniform sampler2D coverage;
#endif
uniform ivec2 corner;

layout(location = 0) out vec4 canvas;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - corner;
    canvas = vec4(0.0);
#ifdef PICTURE
    canvas = texelFetch(picture, at, 0);
#endif
#ifdef ALPHA
    canvas = canvas.wwww;
#endif
#ifdef COVERAGE
    canvas.w = texelFetch(coverage, at, 0).x;
#endif
}
