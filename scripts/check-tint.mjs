// SPDX-License-Identifier: MIT OR Apache-2.0
// Checks WGSL files against WebGPU as browsers implement it (Dawn with Tint); scripts/check-tint runs it.
// Usage: node check-tint.mjs PATH/TO/webgpu/index.js FOLDER
// Exit code: 0 all files pass, 1 one fails, 3 nothing could be checked.

import { readdirSync, readFileSync } from 'node:fs';
import { join, relative, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

// What a stage may declare, used or not, because the host's bind group layouts follow from declarations.
const declared_limits = [
    ['storage buffers', /\bvar\s*<\s*storage\b/g, 'maxStorageBuffersPerShaderStage'],
    ['uniform buffers', /\bvar\s*<\s*uniform\b/g, 'maxUniformBuffersPerShaderStage'],
    ['storage textures', /\bvar\s+\w+\s*:\s*texture_storage_\w+/g, 'maxStorageTexturesPerShaderStage'],
    ['sampled textures', /\bvar\s+\w+\s*:\s*texture_(?!storage_)\w+/g, 'maxSampledTexturesPerShaderStage'],
    ['samplers', /\bvar\s+\w+\s*:\s*sampler\w*/g, 'maxSamplersPerShaderStage'],
];

function wgsl_files(folder) {
    return readdirSync(folder, { withFileTypes: true })
        .sort((a, b) => (a.name < b.name ? -1 : 1))
        .flatMap((entry) => {
            const path = join(folder, entry.name);
            if (entry.isDirectory()) return wgsl_files(path);
            return entry.name.endsWith('.wgsl') ? [path] : [];
        });
}

// Line comments and (nested) block comments become blanks, so that the searches below see code only.
function without_comments(source) {
    let code = '';
    for (let i = 0, depth = 0; i < source.length; i++) {
        const two = source.slice(i, i + 2);
        if (two === '/*') (depth++, i++);
        else if (depth > 0 && two === '*/') (depth--, i++, (code += ' '));
        else if (depth > 0) continue;
        else if (two === '//') {
            while (i < source.length && source[i] !== '\n') i++;
            code += '\n';
        } else code += source[i];
    }
    return code;
}

function entry_points(code) {
    return [...code.matchAll(/@\s*(compute|vertex|fragment)\b[^{;]*?\bfn\s+(\w+)/g)].map(([, stage, name]) => ({ stage, name }));
}

// The validation error of `work`, or null.
async function validation_error(device, work) {
    device.pushErrorScope('validation');
    work();
    return (await device.popErrorScope())?.message ?? null;
}

// Returns the problems of one file, each as lines of text.
async function check(device, source) {
    const code = without_comments(source);
    let module;
    const module_error = await validation_error(device, () => {
        module = device.createShaderModule({ code: source });
    });
    const lines = source.split('\n');
    const messages = [...(await module.getCompilationInfo()).messages];
    if (module_error !== null || messages.some((message) => message.type === 'error')) {
        const text = messages
            .filter((message) => message.type !== 'warning')
            .map(({ lineNum, linePos, type, message }) => `${lineNum}:${linePos}: ${type}: ${message}\n    ${lines[lineNum - 1] ?? ''}`);
        return text.length > 0 ? text : [module_error];
    }

    const entries = entry_points(code);
    if (entries.length === 0) return ['there is no entry point'];
    const problems = [];
    for (const [what, pattern, limit] of declared_limits) {
        const n = [...code.matchAll(pattern)].length;
        if (n > device.limits[limit]) problems.push(`declares ${n} ${what}; WebGPU's default limit is ${device.limits[limit]} per stage`);
    }
    const groups = new Set([...code.matchAll(/@\s*group\s*\(\s*(\d+)/g)].map(([, group]) => Number(group)));
    const too_high = [...groups].filter((group) => group >= device.limits.maxBindGroups);
    if (too_high.length > 0) problems.push(`uses bind group ${too_high}; WebGPU's default limit is ${device.limits.maxBindGroups} groups`);

    // A render pipeline needs both stages and the targets' formats, which a file with one entry point does not say.
    for (const { name } of entries.filter(({ stage }) => stage === 'compute')) {
        // The asynchronous call crashes in Dawn's worker threads under Node.
        const error = await validation_error(device, () => {
            device.createComputePipeline({ layout: 'auto', compute: { module, entryPoint: name } });
        });
        if (error !== null) problems.push(`pipeline of ${name}: ${error}`);
    }
    return problems;
}

const [webgpu_path, folder] = process.argv.slice(2);
const { create, globals } = await import(pathToFileURL(resolve(webgpu_path)));
Object.assign(globalThis, globals);

// `gpu` must stay referenced to the end, because everything else is destroyed with it.
let gpu = create([]);
let adapter = await gpu.requestAdapter();
if (adapter === null) {
    // Dawn validates before its backends do anything, so the null backend misses only what a driver itself rejects.
    console.error('check-tint: Dawn accepts no adapter here (Mesa before 24?); checking without a driver');
    gpu = create(['backend=null']);
    adapter = await gpu.requestAdapter();
}
if (adapter === null) {
    console.error('check-tint: Dawn has no adapter');
    process.exit(3);
}
console.log(`Dawn on ${adapter.info.description || adapter.info.device || 'its null backend'}`);
const device = await adapter.requestDevice(); // no feature and no limit above the default

let n_checked = 0;
let n_failed = 0;
const skipped = [];
for (const path of wgsl_files(folder)) {
    const source = readFileSync(path, 'utf8');
    const name = relative(folder, path);
    if (/^\s*enable\s+wgpu_ray_query\b|:\s*acceleration_structure\b/m.test(source)) {
        skipped.push(name);
        continue;
    }
    n_checked++;
    const problems = await check(device, source);
    if (problems.length === 0) continue;
    n_failed++;
    console.log(`FAIL ${name}`);
    for (const line of problems.join('\n').split('\n').filter((line) => line.trim() !== '')) console.log(`    ${line}`);
}
for (const name of skipped) console.log(`skipped ${name}: ray queries are outside WebGPU`);
if (n_checked === 0) console.log(`no .wgsl file to check in ${folder}`);
else console.log(`${n_checked} files checked, ${n_failed} fail, ${skipped.length} skipped`);
process.exit(n_checked === 0 || n_failed > 0 ? 1 : 0);
