// Where light meets colour, and nowhere else: four terms times what they are worth in XYZ under a spectrum.

uniform sampler2D weights;      // X, Y, Z of every four terms, for each spectrum; a row for every four terms

vec3 folded(vec4 term, int row, int spectrum) {
    return vec3(
        dot(term, texelFetch(weights, ivec2(3 * spectrum, row), 0)),
        dot(term, texelFetch(weights, ivec2(3 * spectrum + 1, row), 0)),
        dot(term, texelFetch(weights, ivec2(3 * spectrum + 2, row), 0)));
}
