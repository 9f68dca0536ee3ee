// A simple surface around an intricate one: CGAL's 3D alpha wrapping (Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner
// and Alliez, Alpha wrapping with an offset, SIGGRAPH 2022). Strictly outside everything of the input, closed,
// 2-manifold, not through itself, whatever the input is: tunnels and gaps narrower than `alpha` are closed, pockets
// within are gone, real holes stay.
//
// Visual hulls need it before their faces get few: where silhouettes nearly agree they are full of tunnels (2690 in
// that of a car from 36 views), each of which holds on to a dozen faces for good, since collapsing an edge never
// changes the genus.
#pragma once

#include "scene/geometry/mesh.h"

namespace lumi {

// alpha: the narrowest gap that is entered; offset: how far the wrap stays off, < alpha; both in world units, > 0.
Mesh TightWrap(const Mesh& mesh, double alpha, double offset);

}  // namespace lumi
