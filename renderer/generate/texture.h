/* Procedural textures; each returns the number of the model's new texture. */
#pragma once
#include "renderer/generate/model.h"

uint32_t texture_paving(struct model *model, uint32_t side); /* 4 x 4 slabs */
uint32_t texture_paving_normal(struct model *model, uint32_t side);
uint32_t texture_stone(struct model *model, uint32_t side);
uint32_t texture_stone_normal(struct model *model, uint32_t side);
uint32_t texture_leaf(struct model *model, uint32_t side); /* alpha: the leaf; stem at the bottom */
