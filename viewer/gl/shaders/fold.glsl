// Folding: four terms of a palette entry times their XYZ under a spectrum.

uniform sampler2D palette;      // XYZ of every four terms for each spectrum: entries side by side, rows of four terms
uniform ivec2 palette_shape;    // entries in a row of the texture; rows of an entry

vec3 folded(vec4 term, int entry, int row, int spectrum) {
    ivec2 at = ivec2(entry % palette_shape.x * SPECTRA + spectrum, entry / palette_shape.x * palette_shape.y + row);
    return vec3(
        dot(term, texelFetch(palette, ivec2(3 * at.x, at.y), 0)),
        dot(term, texelFetch(palette, ivec2(3 * at.x + 1, at.y), 0)),
        dot(term, texelFetch(palette, ivec2(3 * at.x + 2, at.y), 0)));
}
