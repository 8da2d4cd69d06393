// Share of each pixel's samples that see a surface, from a table, since GPUs do not divide exactly.

uniform sampler2D seen;         // triangle index + 1 at every sample, 0 for none
uniform sampler2D shares;       // by the number of samples that see a surface
uniform int samples;            // along a side of a pixel

layout(location = 0) out float coverage;

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * samples;
    int hits = 0;
    for (int n = 0; n < samples * samples; ++n)
        hits += int(texelFetch(seen, corner + ivec2(n % samples, n / samples), 0).x > 0.0);
    coverage = texelFetch(shares, ivec2(hits, 0), 0).x;
}
