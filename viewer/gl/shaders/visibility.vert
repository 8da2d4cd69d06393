// Triangles that are clipped and snapped already: positions land on the grid of 1/256 sample that they were put on.

in vec2 corner;          // clip space
in ivec2 reference;      // the sample at which the depth plane has its value
in vec3 depth_plane;     // d/dx, d/dy, value
in vec2 depth_range;     // lowest and highest nearness of the triangle
in float number;         // triangle number + 1; exact up to 2^24

flat out ivec2 plane_reference;
flat out vec3 plane;
flat out vec2 plane_range;
flat out float triangle;

void main() {
    plane_reference = reference;
    plane = depth_plane;
    plane_range = depth_range;
    triangle = number;
    gl_Position = vec4(corner, 0.0, 1.0);
}
