// A constant, for tiles whose answer is known. CONSTANT: a vec4.
layout(location = 0) out vec4 value;
void main()
{
    value = CONSTANT;
}
