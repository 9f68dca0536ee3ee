// The functions that make the published methods, one in each file; comparators.cc chooses among them.
#pragma once

#include <memory>

#include "render/radiance/frame_plan.h"
#include "render/radiance/ray_method.h"
#include "render/radiance/sources.h"

namespace lumi {

using ComparatorMaker = std::shared_ptr<const RayMethod>(const Sources& sources, const ProxyTracer& proxy,
                                                         const ViewSetup& setup);
ComparatorMaker MakeChenWilliams;
ComparatorMaker MakeLevoyHanrahan;
ComparatorMaker MakeGortler;
ComparatorMaker MakeDebevec1996;
ComparatorMaker MakeSeitzDyer;
ComparatorMaker MakePulli;
ComparatorMaker MakeDebevec1998;
ComparatorMaker MakePighin;
ComparatorMaker MakeHeigl;
ComparatorMaker MakeLhuillierQuan;
ComparatorMaker MakeWood;
ComparatorMaker MakeSibrUlr;

}  // namespace lumi
