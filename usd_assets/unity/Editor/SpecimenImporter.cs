// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    /// <summary>
    /// Imports a `.stereocell` file as a prefab. The file is a link to a bundle's folder, or a zip file of this folder.
    /// The import runs again when the bundle changes. It writes no file, and it leaves the project's own materials,
    /// variants and scenes as they are.
    /// </summary>
    [ScriptedImporter(1, Ending)]
    public sealed class SpecimenImporter : ScriptedImporter
    {
        public const string Ending = "stereocell";

        public ImportOptions options = new ImportOptions();

        public override void OnImportAsset(AssetImportContext ctx)
        {
            ctx.DependsOnSourceAsset(SpecimenBuilder.ShaderPath);
            ctx.DependsOnCustomDependency(BundleWatcher.PipelineName);  // glTFast's materials are for one pipeline
            GameObject root = null;
            try
            {
                var folder = BundleFiles.LinkedFolder(ctx.assetPath);
                if (folder != null) ctx.DependsOnCustomDependency(BundleWatcher.NameOf(folder));
                using (var files = BundleFiles.Open(ctx.assetPath))
                {
                    var bundle = new Bundle(files);
                    if (bundle.LeftOut.Count > 0) ctx.LogImportWarning(ctx.assetPath + ": these parts of the bundle are not imported: " + string.Join(", ", bundle.LeftOut));
                    root = new GameObject(bundle.Name);
                    var guid = AssetDatabase.AssetPathToGUID(ctx.assetPath);
                    new SpecimenBuilder(bundle, options, guid, OwnMaterial, ctx.AddObjectToAsset).Build(root);
                }
                ctx.AddObjectToAsset("specimen", root);
                ctx.SetMainObject(root);
            }
            catch (Exception error) when (error is IOException || error is InvalidDataException)
            {
                if (root != null) Object.DestroyImmediate(root);
                ctx.LogImportError(ctx.assetPath + ": " + error.Message);
            }
        }

        /// <summary>The key of a channel's surface material in <see cref="AssetImporter.AddRemap"/>.</summary>
        public static SourceAssetIdentifier MaterialOf(string channel)
        {
            return new SourceAssetIdentifier(typeof(Material), channel);
        }

        Material OwnMaterial(string channel)
        {
            Object found;
            return GetExternalObjectMap().TryGetValue(MaterialOf(channel), out found) ? found as Material : null;
        }
    }
}
