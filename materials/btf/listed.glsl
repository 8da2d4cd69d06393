// Entries of long lists, which lie row by row: twin of texels.folded, whose rows are of 2^14 unless there is one alone.

vec4 listed(sampler2D list, int number) {
    return texelFetch(list, ivec2(number & 16383, number >> 14), 0);
}
