// Position of a sample among the vertices of its part, as triangles were subdivided; twin of Halving.located.

uniform sampler2D standing;     // of each sample: weights of its triangle's second and third corner
uniform sampler2D faces;        // of each triangle of the window: index in the scene + 1, negative if its back
                                // is seen, and its normal on the viewer's side
uniform isampler2D nodes;       // of each triangle of the scene, then of each cut: see light_textures._nodes
uniform isampler2D sites_of;    // of each vertex: site in front and behind, -1 inside solids

ivec4 node(int number) { return texelFetch(nodes, ivec2(number % ROW_LENGTH, number / ROW_LENGTH), 0); }

// The three vertices around a point, given the weights of its triangle's second and third corner.
void locate(int triangle, vec2 place, out int corners[3], out float weights[3]) {
    ivec4 whole = node(triangle);
    corners = int[3](whole.x, whole.y, whole.z);
    weights = float[3](1.0 - place.x - place.y, place.x, place.y);
    for (int at = whole.w; at >= 0;) {
        ivec4 cut = node(at);
        int p = (cut.x + 1) % 3, q = (cut.x + 2) % 3;
        float near = weights[p], far = weights[q];
        bool nearer = near >= far;
        corners[nearer ? q : p] = cut.y;
        weights[p] = nearer ? near - far : 2.0 * near;
        weights[q] = nearer ? 2.0 * far : far - near;
        at = nearer ? cut.z : cut.w;
    }
}

// The three sites around a sample, on the visible side, and their weights; -1 inside solids.
void sites_near(int number, ivec2 sample_at, out vec4 face, out int near[3], out float weights[3]) {
    face = texelFetch(faces, ivec2((number - 1) % ROW_LENGTH, (number - 1) / ROW_LENGTH), 0);
    locate(int(abs(face.x)) - 1, texelFetch(standing, sample_at, 0).xy, near, weights);
    for (int c = 0; c < 3; ++c) {
        ivec2 both = texelFetch(sites_of, ivec2(near[c] % ROW_LENGTH, near[c] / ROW_LENGTH), 0).xy;
        near[c] = face.x < 0.0 ? both.y : both.x;
    }
}
