// Anything that reflects: a measurement, a model, a closure.
#pragma once

#include <functional>

#include "measurement/vector3.h"

namespace lobefit {

// Reflectance f in 1/sr for unit vectors toward the light (wi) and the viewer (wo) in the local
// frame whose normal is +z; NaN where it is not known. Called from several threads at once.
using Reflectance = std::function<Rgb(const Vector3& wi, const Vector3& wo)>;

}  // namespace lobefit
