#include "levelset/convert/band_file.h"
