#pragma once

#include <gamer/galaxy/component.h>

/// A kind of component: an ellipsoid of Gaussian density, exp(-(x^2 + y^2 + z^2/q^2)/(2 sigma^2)).
gamer::ComponentKind gaussian_kind();
