#include "mapping/rbf_map.h"
