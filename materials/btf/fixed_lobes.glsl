// Gaussians of fixed axes and a bent cosine, twin of fixed_lobes.py: what each gathers is a sum of `Here.terms`.

uniform sampler2D taken;        // a row a function: each term's weight on the function
uniform sampler2D axes;         // axis of each Gaussian, and 1 / lambda

mat3 frame_of(Here here) {
    return mat3(1.0);
}

vec4 lobe(Here here, int number) {
    return texelFetch(axes, ivec2(number, 0), 0);
}

vec4 value(Here here, int number, int row) {
    vec4 total = vec4(0.0);
    for (int k = 0; k < TERMS; ++k)
        total += texelFetch(taken, ivec2(k / 4, number), 0)[k % 4] * here.terms[k * FOURS + row];
    return number < LOBES ? total : PI * total;
}
