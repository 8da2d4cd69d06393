// Index of the nearest triangle at each sample; twin of raster.rasterise.

uniform int key_base;
uniform int key_shift;

flat in ivec2 plane_reference;
flat in vec3 plane;
flat in vec2 plane_range;
flat in float triangle;

out float seen;

void main() {
    // One multiplication or addition at a time, never fused, bit-identical to numpy's float32.
    vec2 offset = vec2(ivec2(gl_FragCoord.xy) - plane_reference);
    precise float along_x = plane.x * offset.x;
    precise float along_y = plane.y * offset.y;
    precise float slope = along_x + along_y;
    precise float nearness = slope + plane.z;
    nearness = min(max(nearness, plane_range.x), plane_range.y);
    int key = (floatBitsToInt(nearness) - key_base) >> key_shift;
    // Offset by a quarter of a step of the 24-bit buffer, so that neither rounding nor truncation changes the key.
    gl_FragDepth = (float(key) * 4.0 + 1.5) / 16777216.0;
    seen = triangle;
}
